# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fig. 8 of Kaul 2015: how far away what is measured is, in three surroundings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.plot import Series, line_plot
from bentwing.reproduce.figure import Compared, Figure
from bentwing.simulate.scenario import Scenario
from bentwing.simulate.simulation import prepare

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.reproduce.figure import Assignment
    from bentwing.simulate.setup import Setup

_EVERY, _LONG = 6.0, 1.0  # s; so long is looked at so often
_SPIN_UP, _LANDING = 12.0, 8.0  # s at the ends of a flight that are left out
_OWN = 0.7  # m; nearer there is the carrier only
_SHOWN = 20.0  # m


def range_figure(
    flights: dict[str, Setup], assignment: Assignment
) -> tuple[Figure, list[Compared], dict[str, float]]:
    """Draw the distribution of ranges in a yard with a hut and in the given flights."""
    yard = Scenario(scene="courtyard", duration=45.0, max_range=15.0, seed=assignment.seed)
    samples = {"yard with a shed": sampled_ranges(prepare(yard))}
    samples |= {name: sampled_ranges(setup) for name, setup in flights.items()}
    x = np.linspace(0.0, _SHOWN, 301)
    lines = [
        Series(
            name,
            x,
            np.searchsorted(ranges, x) / len(ranges),
        )
        for name, ranges in samples.items()
    ]
    medians = {name: float(np.median(ranges)) for name, ranges in samples.items()}
    near = {name: float((ranges < 7.0).mean()) for name, ranges in samples.items()}
    figure = Figure(
        "fig08",
        line_plot(lines, "range, m", "share of the ranges below", top=1.0),
        "Fig. 8",
        "Ranges in flight. In the paper: huts, an industrial compound and a forest. Medians: "
        + ", ".join(f"{name} {median:.1f} m" for name, median in medians.items())
        + ".",
    )
    ours = "; ".join(f"{name} {near[name]:.0%}, median {medians[name]:.1f} m" for name in samples)
    row = Compared("Ranges below 7 m", "a significant share within 5 to 7 m", ours)
    return figure, [row], medians


def sampled_ranges(setup: Setup) -> NDArray[np.float64]:
    """Sorted ranges (N,), m, of a second of flight now and then."""
    found = []
    for start in np.arange(setup.first + _SPIN_UP, setup.last - _LANDING, _EVERY).tolist():
        beams = setup.rig.head.lidar.beams(start, start + _LONG)
        if beams is not None:
            ranges, _ = setup.sensors.ranger.measure(beams)
            found.append(ranges[np.isfinite(ranges) & (ranges > _OWN)])
    return np.sort(np.concatenate(found))
