# SPDX-License-Identifier: MIT OR Apache-2.0
"""Kaul 2015, Figs. 9, 10, 11 and 26: spin rates, controller, its answer, and the bumper's map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.flight.control import SpinSettings
from bentwing.report.histogram import histogram
from bentwing.report.plot import Series, line_plot
from bentwing.reproduce.block_diagram import controller_diagram
from bentwing.reproduce.bumper_view import bumper_figures
from bentwing.reproduce.figure import Assignment, Figure, Part
from bentwing.simulate.plant.drives import FLAPS
from bentwing.simulate.plant.flights import CONTROL_STEP, Drive, fly
from bentwing.simulate.plant.outcomes import SPIN_UP
from bentwing.simulate.plant.weather import Weather

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

AVERAGE = 5.0
"""s, over which Fig. 9 averages the rates."""
_EDGES = np.arange(0.0, 501.0, 10.0)
_FLAP_RATE = np.radians(200.0)
_MULTIFLAP_RATES = np.radians([200.0, 240.0, 270.0, 310.0, 350.0])
_BREEZE = Weather(max_wind=4.0, max_mean=1.5)
_WINDY = Weather(max_mean=4.0, gust_interval=8.0)


def flight_part(assignment: Assignment) -> Part:
    """Make the figures; a quick assignment flies a fifth of the time."""
    minutes = 1.5 if assignment.quick else 7.0
    figures, numbers = _fig9(60.0 * minutes)
    step, answer = _fig11()
    return Part(
        "Kaul 2015, flight: Figs. 9, 10, 11 and 26",
        [*figures, _fig10(), step, *bumper_figures(seed=4)],
        {**numbers, **answer},
    )


def _fig9(duration: float) -> tuple[list[Figure], dict[str, Any]]:
    n = len(_MULTIFLAP_RATES)
    flaps = fly(
        Drive(plant=FLAPS), _BREEZE, n=n, duration=duration, seed=9, desired=_FLAP_RATE
    ).rates
    multi = fly(
        Drive(), _BREEZE, n=n, duration=duration, seed=9, desired=lambda _: _MULTIFLAP_RATES
    ).rates
    figures, numbers = [], {}
    for letter, name, rates, theirs in (
        ("a", "original flaps", flaps, "150 to 210 °/s, with a tail below in crosswinds"),
        ("b", "multiflaps", multi, "160 to 350 °/s, another rate chosen for each flight"),
    ):
        means = np.degrees(_averaged(rates))
        samples = {f"flight {k + 1}": means[:, k] for k in range(n)}
        figures.append(
            Figure(
                f"fig09{letter}",
                histogram(samples, _EDGES, "rate averaged over 5 s, °/s"),
                f"Fig. 9{letter}, {name}",
                f"Five simulated flights of {duration / 60:g} min. In the paper: {theirs}.",
            )
        )
        numbers[f"fig9_{name.replace(' ', '_')}_percentiles_deg"] = np.percentile(
            means, [0, 1, 50, 99, 100]
        ).tolist()
    return figures, numbers


def _averaged(rates: NDArray[np.float32]) -> Array:
    """Means (W, N) over windows of `AVERAGE`, from the end of the spin-up on."""
    size = round(AVERAGE / CONTROL_STEP)
    flown = rates[round(SPIN_UP / CONTROL_STEP) :]
    whole = len(flown) // size * size
    return np.asarray(flown[:whole].reshape(-1, size, flown.shape[1]).mean(axis=1), np.float64)


def _fig10() -> Figure:
    return Figure(
        "fig10",
        controller_diagram(SpinSettings()),
        "Fig. 10",
        "The three terms of the controller with their gains, summed and limited.",
    )


def _fig11() -> tuple[Figure, dict[str, Any]]:
    """Twenty seconds in wind while the pilot changes the desired rate around the threshold."""

    def wish(time: float) -> Array:
        steps = np.radians([230.0, 300.0, 210.0, 260.0])
        return np.full(1, steps[int(max(time - SPIN_UP, 0.0) // 5.0) % 4])

    # A softer gain than the default: the paper's follows loosely and leaves work to the prevention.
    loose = SpinSettings(proportional_gain=0.05)
    flown = fly(Drive(loose), _WINDY, n=1, duration=SPIN_UP + 20.0, seed=11, desired=wish)
    shown = flown.times >= SPIN_UP
    times = flown.times[shown] - SPIN_UP
    actual = np.degrees(flown.measured[shown, 0].astype(np.float64))
    desired = np.degrees(flown.desired[shown, 0].astype(np.float64))
    threshold = np.full(len(times), 180.0)
    drawing = line_plot(
        [
            Series("actual", times, actual),
            Series("desired", times, desired),
            Series("stall threshold", times, threshold),
        ],
        "time, s",
        "rate, °/s",
    )
    note = (
        "Desired and measured rate in gusts up to 6 m/s, with a loose proportional gain. Below 180 °/s "
        "the stall prevention sets in and overshoots. In the paper the rate stays in 150 to 450 °/s."
    )
    below, over = float(actual.min()), float((actual - desired).max())
    return Figure("fig11", drawing, "Fig. 11", note), {
        "fig11_lowest_deg": below,
        "fig11_highest_deg": float(actual.max()),
        "fig11_largest_overshoot_deg": over,
    }
