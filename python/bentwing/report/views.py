# SPDX-License-Identifier: MIT OR Apache-2.0
"""The views of a map a report shows: oblique, from above, from the side, and cut open."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.report.colours import HEIGHT, TIME
from bentwing.report.frame import ShownFrame
from bentwing.report.picture import paint, project, render
from bentwing.report.plan import draw_plan
from bentwing.report.stretches import degenerate
from bentwing.report.svg import map_view
from bentwing.report.texts import ENGLISH
from bentwing.report.way import Way

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.report.plan import Mark
    from bentwing.report.texts import Texts

_WAY = ("1f2933", "c8412e")  # seen in all directions, and not
SLAB = 1.0  # m, thickness of the section
_HEADROOM = 0.3  # m above the sensor from which on a point counts as overhead
_CEILING_BIN, _CEILING_ROOM = 0.05, 0.15  # m, and m of it that goes with the ceiling
_NEAR = 2.0  # m beside the sensor within which overhead points tell a roof
_ROOFED_SHARE = 0.5  # of the seconds; in the open almost nothing is ever right above the sensor


@dataclass(frozen=True, slots=True)
class MapViews:
    """SVG drawings of one map.

    `ceiling` is the height, m, above which a view from above shows the roof only, None in the open;
    `is_north_up` says whether the plan's y axis is grid north.
    """

    plan: str
    oblique: str
    plan_time: str
    side: str
    section: str
    ceiling: float | None
    is_north_up: bool


def draw_views(
    points: NDArray[np.float64],
    times: NDArray[np.float64],
    trajectory: Trajectory,
    windows: Sequence[Mapping[str, Any]] = (),
    *,
    frame: ShownFrame | None = None,
    marks: Sequence[Mark] = (),
    texts: Texts = ENGLISH,
) -> MapViews:
    """Draw all views of a map.

    Parameters
    ----------
    points : (N, 3) float64, m, map frame
    times : (N,) s since the recording's start
    trajectory : of the IMU; drawn over the plan
    windows : records of the estimate; where one is degenerate the path is red
    frame : of points and trajectory; default: the map's own
    marks : surveyed points
    texts : words of the language
    """
    overhead = overhead_points(points, times, trajectory)
    along, beside = _directions(points)
    path = trajectory.positions
    unsure = degenerate(trajectory.times, windows).astype(np.float64)
    way = Way(path[:, 0], path[:, 1], unsure, _WAY)
    plan, plan_times = points[~overhead], times[~overhead]
    x, y, z = plan.T
    from_above = project(x, y, z, width=1100, max_height=760)
    by_height = paint(from_above, z)
    by_time = paint(from_above, plan_times, table=TIME, shading=0.5)
    centre = np.median(path, axis=0) if len(path) else np.zeros(3)
    slab = np.abs((points - centre) @ beside) < SLAB / 2
    shown = frame or ShownFrame()
    return MapViews(
        plan=draw_plan(by_height, shown, way=way, marks=marks, texts=texts),
        oblique=oblique_view(plan, plan[:, 2], texts.height_legend),
        plan_time=map_view(by_time, texts.time_legend, TIME, name=texts.by_time),
        side=_upright(points, along, beside, texts.side, texts),
        section=_upright(points[slab], along, beside, texts.section, texts),
        ceiling=ceiling_of(points[overhead, 2]),
        is_north_up=shown.is_north_up,
    )


def overhead_points(
    points: NDArray[np.float64], times: NDArray[np.float64], trajectory: Trajectory
) -> NDArray[np.bool_]:
    """Tell which points `(N,)` are above the sensor at their time, if there is a roof at all.

    In the open nothing is marked: what is high there is what one wants to see from above.
    """
    if not len(points) or not len(trajectory.times):
        return np.zeros(len(points), np.bool_)
    above: NDArray[np.bool_] = points[:, 2] - _followed(trajectory, times, 2) > _HEADROOM
    high, when = points[above], times[above]
    beside = [high[:, axis] - _followed(trajectory, when, axis) for axis in range(2)]
    seconds = np.floor(when[np.hypot(*beside) < _NEAR])
    roofed = len(np.unique(seconds)) > _ROOFED_SHARE * len(np.unique(np.floor(times)))
    return above if roofed else np.zeros(len(points), np.bool_)


def ceiling_of(heights: NDArray[np.float64]) -> float | None:
    """Return a height just below most of the points (N,) m that are overhead; None without any."""
    if not len(heights):
        return None
    bins = np.floor(heights / _CEILING_BIN).astype(np.int64)
    levels, counts = np.unique(bins, return_counts=True)
    return float(levels[counts.argmax()] * _CEILING_BIN - _CEILING_ROOM)


def _followed(trajectory: Trajectory, times: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """One coordinate `(N,)` of the sensor at any times, held beyond the trajectory's ends."""
    return np.interp(times, trajectory.times, trajectory.positions[:, axis])


def oblique_view(
    points: NDArray[np.float64],
    values: NDArray[np.float64],
    label: str,
    table: tuple[str, ...] = HEIGHT,
    *,
    path: NDArray[np.float64] | None = None,
    close_gaps: int = 3,
) -> str:
    """Draw a map from 35° above the horizon, a quarter turned from its longer side.

    Parameters
    ----------
    points : (N, 3) m, map frame
    values : (N,) what the colour shows
    label : of the values, with unit
    table : colour map
    path : (M, 3) m, of the sensor, drawn over the map by its time
    close_gaps : pixels
    """
    along, beside = _directions(points)
    turn, lift = np.radians([28.0, 35.0])
    across = np.cos(turn) * along + np.sin(turn) * beside
    level = np.cos(turn) * beside - np.sin(turn) * along  # away from the viewer
    up = np.sin(lift) * level + np.cos(lift) * np.array([0.0, 0.0, 1.0])
    toward = -np.cos(lift) * level + np.sin(lift) * np.array([0.0, 0.0, 1.0])
    seen = project(
        points @ across, points @ up, points @ toward, max_height=640, close_gaps=close_gaps
    )
    way = None
    if path is not None:
        way = Way(path @ across, path @ up, np.linspace(0.0, 1.0, len(path)), TIME)
    view = paint(seen, values, table=table)
    return map_view(view, label, table, way=way, name="Oblique view", text_size=22)


def _upright(
    points: NDArray[np.float64],
    along: NDArray[np.float64],
    beside: NDArray[np.float64],
    name: str,
    texts: Texts,
) -> str:
    across, up, toward = points @ along, points[:, 2], -(points @ beside)
    # gaps stay, because closing them would make walls look thicker than they are
    view = render(across, up, toward, up, max_height=420, close_gaps=0)
    return map_view(view, texts.height_legend, HEIGHT, name=name, text_size=22)


def _directions(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Horizontal unit vectors along the map's longer extent and to the left of it."""
    if len(points) < 2:
        return np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    _, vectors = np.linalg.eigh(np.cov(points[:: max(len(points) // 100_000, 1), :2].T))
    x, y = vectors[:, 1] * (1.0 if vectors[0, 1] >= 0 else -1.0)
    return np.array([x, y, 0.0]), np.array([-y, x, 0.0])
