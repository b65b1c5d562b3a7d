# SPDX-License-Identifier: MIT OR Apache-2.0
"""The figures of Fu 2023 as ours: 7 to 12, and why a filter without the rotation fails."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.plot import Series, line_plot
from bentwing.reproduce.drawing import map_from_above, oblique_map, positions_over
from bentwing.reproduce.figure import Figure

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.reproduce.campaign import Flown, Result

    Array = NDArray[np.float64]

_PLACES = (
    ("mocap", "fig08", "Fig. 8", "the room with motion capture"),
    ("carpark", "fig09b", "Fig. 9b", "the car park"),
    ("campus", "fig11", "Fig. 11", "the campus"),
)
_MAPS = (
    ("mocap", "fig07", "Fig. 7", "A room"),
    ("carpark", "fig10", "Fig. 10", "A car park, without its ceiling"),
    ("campus", "fig12", "Fig. 12", "A campus"),
)
_OVERHEAD = 0.6  # m above the highest place of the sensor: what is higher hides the view indoors
_LEAST = 1e-3  # m, the smallest error that a logarithmic axis shows
_FARTHEST = 100.0  # m, from the truth: farther outside no point is drawn


def fu_figures(flown: dict[str, Flown]) -> list[Figure]:
    """Draw all figures."""
    figures = [f for place in _PLACES for f in _positions(flown, *place)]
    figures += [f for place in _MAPS for f in _maps(flown, *place)]
    return [*figures, *_failure(flown["mocap, turning"])]


def _found(flown: dict[str, Flown], scene: str) -> dict[str, Result]:
    turning, fixed = flown[f"{scene}, turning"].results, flown[f"{scene}, fixed"].results
    return {
        "Ours (kalman)": turning["kalman"],
        "F-FAST-LIO": fixed["F-FAST-LIO"],
        "R-FAST-LIO": turning["R-FAST-LIO"],
        "continuous": turning["continuous"],
    }


def _positions(
    flown: dict[str, Flown], scene: str, name: str, title: str, where: str
) -> list[Figure]:
    """Draw positions over time, and the errors that are too small to be seen in them."""
    found, truth = _found(flown, scene), flown[f"{scene}, turning"].truth
    tracks = {n: r.from_start if r.lost else r.aligned for n, r in found.items()}
    figures = []
    for axis, drawing in zip(
        "xyz", positions_over(truth.times, truth, tracks, "time, s"), strict=True
    ):
        note = f"{axis} in {where}; a line ends where the estimate leaves the picture."
        figures.append(Figure(f"{name}_{axis}", drawing, f"{title}, {axis}", note))
    errors = [
        Series(label, result.distance_times[::10], 100 * result.distances[::10])
        for label, result in found.items()
        if not result.lost
    ]
    plot = line_plot(errors, "time, s", "distance from the truth, cm")
    note = f"Distance from the truth in {where}, of the estimates that did not fail."
    return [*figures, Figure(f"{name}_error", plot, f"{title}, errors", note)]


def _maps(flown: dict[str, Flown], scene: str, name: str, title: str, what: str) -> list[Figure]:
    figures = []
    for kind, trial, letter in (("turning", "kalman", "a"), ("fixed", "F-FAST-LIO", "b")):
        flight = flown[f"{scene}, {kind}"]
        path = flight.truth.positions[::20]
        ceiling = None if scene == "campus" else float(path[:, 2].max()) + _OVERHEAD
        result = flight.results[trial]
        lidar = "turned by the motor" if kind == "turning" else "fixed"
        figures.append(
            Figure(
                f"{name}{letter}",
                oblique_map(_near(result.points, path), path, ceiling),
                f"{title}{letter}",
                f"{what}, mapped by {trial} with a lidar that is {lidar}; the path by time.",
            )
        )
    return figures


def _failure(flight: Flown) -> list[Figure]:
    """Show what the filter sees if nobody tells it of the motor."""
    ours, ignored = flight.results["kalman"], flight.results["R-FAST-LIO"]
    path = flight.truth.positions[::20]
    ceiling = float(path[:, 2].max()) + _OVERHEAD
    shares = [
        Series(
            name,
            np.array([w.time for w in result.windows]),
            np.array([100.0 * (w.inlier_share or 0.0) for w in result.windows]),
        )
        for name, result in (("Ours (kalman)", ours), ("R-FAST-LIO", ignored))
    ]
    errors = [
        Series(name, flight.truth.times[::10], _log_errors(flight, result)[::10])
        for name, result in (("Ours (kalman)", ours), ("R-FAST-LIO", ignored))
        if result.from_start is not None
    ]
    return [
        Figure(
            "why_a",
            map_from_above(_near(flight.true_points, path), path, ceiling),
            "Why R-FAST-LIO fails, 1",
            "The room from above, without its ceiling: returns put in place by the true poses and the "
            "encoder's angles.",
        ),
        Figure(
            "why_b",
            map_from_above(_near(flight.unturned_points, path), path, ceiling),
            "Why R-FAST-LIO fails, 2",
            "The same returns by the same true poses, but as if the motor stood still: each sweep of 0.1 s is "
            "turned by 36° against the one before, about an axis that the inertial sensor does not feel. No "
            "surface is where the map has it, even with a perfect trajectory.",
        ),
        Figure(
            "why_c",
            line_plot(shares, "time, s", "matches that agree, %", top=100),
            "Why R-FAST-LIO fails, 3",
            "Share of the matches that agree with the pose. Without the rotation those that are left agree "
            "with a carrier that turns once per second, which the gyroscope denies.",
        ),
        Figure(
            "why_d",
            line_plot(errors, "time, s", "log10 of the distance from the truth in m"),
            "Why R-FAST-LIO fails, 4",
            "How far it is carried away: 0 is one metre, 2 a hundred.",
        ),
    ]


def _log_errors(flight: Flown, result: Result) -> Array:
    """Return log10 of the distances (N,) in m from the truth, given the first pose."""
    errors = np.full(len(flight.truth.times), np.nan)
    if result.from_start is not None:
        there = result.from_start.covers(flight.truth.times)
        found, _ = result.from_start.interpolate(flight.truth.times[there])
        distances = np.linalg.norm(found - flight.truth.positions[there], axis=1)
        errors[there] = np.log10(np.maximum(distances, _LEAST))
    return errors


def _near(points: NDArray[np.float32], path: Array) -> NDArray[np.float32]:
    """Leave out what is far outside of the place."""
    distance = np.linalg.norm(points - path.mean(axis=0), axis=1)
    near: NDArray[np.float32] = points[distance < _FARTHEST]
    return near
