# SPDX-License-Identifier: MIT OR Apache-2.0
"""The figures of Tazir 2020 as ours: 4, 7 to 10, 12, 13 and 15."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.picture import paint, project
from bentwing.report.plot import Series, line_plot
from bentwing.report.svg import map_view
from bentwing.reproduce.drawing import angles_over, map_from_above, oblique_map, positions_over
from bentwing.reproduce.figure import Figure

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bentwing.reproduce.campaign import Flown
    from bentwing.reproduce.tazir_measures import Measured

    Array = NDArray[np.float64]
    All = Mapping[str, Mapping[str, Measured]]

_TWO = ("2c5f8a", "c8331e")  # georeferenced and estimated
_REACH = 70.0  # m, from the way: farther outside nothing is drawn
_SLOW, _FAST, _FIXED = "town, 0.5 rad/s", "town, 1 rad/s", "town, fixed"


def tazir_figures(flown: dict[str, Flown], measured: All) -> list[Figure]:
    """Draw all figures of the flights."""
    return [
        *_town_maps(flown),
        *_trajectories(flown),
        *_errors(measured),
        *_registration(measured),
        *_dam(flown),
    ]


def _town_maps(flown: dict[str, Flown]) -> list[Figure]:
    slow, fixed = flown[_SLOW], flown[_FIXED]
    path = slow.truth.positions[::50]
    found, georeferenced = (_near(p, path) for p in (slow.results["ndt"].points, fixed.true_points))
    share = {n: _covered(p, path) for n, p in (("turning", found), ("fixed", georeferenced))}
    return [
        Figure("fig04", oblique_map(found, path), "Fig. 4", "Map by `ndt` of the turning lidar, with the path."),
        Figure("fig09", oblique_map(georeferenced, path), "Fig. 9", "Map of the fixed lidar, made with the true poses."),
        Figure(
            "fig10",
            _overlay(georeferenced, found),
            "Fig. 10",
            "Both from above: blue from true poses and the fixed lidar, red from the odometry of the turning one. "
            f"Within 40 m of the path {100 * share['turning']:.0f} % of the square metres have a point with the turning "
            f"lidar, {100 * share['fixed']:.0f} % with the fixed one.",
        ),
        Figure("section52", map_from_above(_near(fixed.results["ndt"].points, path), path), "Section 5.2", "What `ndt` makes of the fixed lidar."),
    ]  # fmt: skip


def _covered(points: NDArray[np.float32], path: Array) -> float:
    """Share of the square metres within 40 m of the way, seen from above, that have a point."""
    low = np.floor(path[:, :2].min(axis=0) - 40.0)
    size = np.ceil(path[:, :2].max(axis=0) + 40.0 - low).astype(int)
    centres = (
        np.stack(np.meshgrid(*(np.arange(n) + 0.5 for n in size), indexing="ij"), axis=-1) + low
    )
    distances = [
        np.linalg.norm(centres - place, axis=-1) for place in path[:: max(len(path) // 60, 1), :2]
    ]
    inside = np.min(distances, axis=0) < 40.0
    filled = np.zeros(size, bool)
    cells = np.floor(points[:, :2] - low).astype(int)
    cells = cells[((cells >= 0) & (cells < size)).all(axis=1)]
    filled[cells[:, 0], cells[:, 1]] = True
    return float(filled[inside].mean())


def _overlay(blue: NDArray[np.float32], red: NDArray[np.float32]) -> str:
    cloud = np.concatenate([blue, red]).astype(np.float64)
    if not len(cloud):
        return '<p class="none">No points were mapped.</p>'
    kind = np.concatenate([np.zeros(len(blue)), np.ones(len(red))])
    seen = project(*cloud.T, width=1000, max_height=800, close_gaps=1)
    view = paint(seen, kind, table=_TWO, span=(0.0, 1.0))
    return map_view(view, "true poses, odometry", _TWO, name="Both maps")


def _trajectories(flown: dict[str, Flown]) -> list[Figure]:
    """Draw positions and angles over time, as figures 7 and 8 do."""
    figures = []
    for letter, name in (("a", _SLOW), ("b", _FIXED)):
        flight = flown[name]
        found = {n: r.from_start for n, r in flight.results.items()}
        kinds = (
            ("fig07", "Fig. 7", positions_over, "xyz"),
            ("fig08", "Fig. 8", angles_over, ("roll", "pitch", "yaw")),
        )
        for number, title, draw, axes in kinds:
            drawings = draw(flight.truth.times, flight.truth, found, "time, s")
            for axis, drawing in zip(axes, drawings, strict=True):
                note = f"{axis} over the {name}; a line ends where the estimate leaves the picture."
                figures.append(
                    Figure(f"{number}{letter}_{axis}", drawing, f"{title}{letter}, {axis}", note)
                )
    return figures


def _errors(measured: All) -> list[Figure]:
    """Draw RTE and RRE over the way."""
    figures = []
    for kind, unit, number in (("rte", "m", "fig12"), ("rre", "°", "fig08")):
        for trial in ("ndt", "continuous"):
            lines = []
            for name in (_SLOW, _FAST, _FIXED):
                found = measured[name].get(trial)
                if found is None or (
                    name == _FIXED and found.lost_after is not None and kind == "rre"
                ):
                    continue
                values = found.errors.rte if kind == "rte" else np.degrees(found.errors.rre)
                ends = (
                    len(values)
                    if found.lost_after is None
                    else int(np.argmax(values > _TOP)) or len(values)
                )
                lines.append(Series(name, found.way[:ends:10], values[:ends:10]))
            figures.append(
                Figure(
                    f"{number}_{kind}_{trial}",
                    line_plot(lines, "way, m", f"{kind.upper()}, {unit}"),
                    f"{'Fig. 12' if kind == 'rte' else 'Fig. 8'}, {kind.upper()} of {trial}",
                    "Error of the pose when the first one is given.",
                )
            )
    return figures


_TOP = 12.0  # of RTE or RRE: what is lost is not followed farther


def _registration(measured: All) -> list[Figure]:
    """Draw the RMSE of every scan, and its mean, as figure 13 does."""
    figures = []
    for letter, name in (("a", _SLOW), ("b", _FAST)):
        found = measured[name].get("ndt")
        if found is None or not len(found.registration):
            continue
        times, rmse = found.registration.T
        lines = [
            Series("scans", times, rmse),
            Series("mean", times, np.full(len(rmse), rmse.mean())),
        ]
        figures.append(
            Figure(
                f"fig13{letter}",
                line_plot(lines, "time, s", "registration RMSE, m"),
                f"Fig. 13{letter}, {name}",
                f"Distance of each scan's points from the keyframes' surfaces; the mean is {rmse.mean():.3f} m.",
            )
        )
    return figures


def _dam(flown: dict[str, Flown]) -> list[Figure]:
    turning, fixed = flown["dam, 0.5 rad/s"], flown["dam, fixed"]
    path = turning.truth.positions[::50]
    return [
        Figure("fig15", oblique_map(_near(turning.results["ndt"].points, path, 150.0), path), "Fig. 15", "The dam, by `ndt` with the turning lidar at 70 m and 4 m/s."),
        Figure("section561", oblique_map(_near(fixed.results["ndt"].points, path, 150.0), path), "Section 5.6.1", "The same with the fixed lidar, from which the paper's odometry made no map."),
    ]  # fmt: skip


def _near(points: NDArray[np.float32], path: Array, reach: float = _REACH) -> NDArray[np.float32]:
    """Leave out what is far outside of the way's box."""
    low, high = path.min(axis=0) - reach, path.max(axis=0) + reach
    inside: NDArray[np.float32] = points[((points >= low) & (points <= high)).all(axis=1)]
    return inside
