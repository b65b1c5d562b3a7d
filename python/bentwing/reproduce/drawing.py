# SPDX-License-Identifier: MIT OR Apache-2.0
"""Figures that several papers have: positions and errors over time, and maps side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.report.colours import HEIGHT
from bentwing.report.picture import paint, project
from bentwing.report.plot import Series, line_plot
from bentwing.report.svg import map_view
from bentwing.report.views import oblique_view
from bentwing.report.way import Way

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory

    Array = NDArray[np.float64]

_STEP = 10  # of 100 Hz poses, in a drawing
_OFF = 0.75  # of the extent of the way: farther outside nothing is drawn


def positions_over(
    x: Array, truth: Trajectory, found: Mapping[str, Trajectory | None], x_label: str
) -> list[str]:
    """Draw x, y and z from the start of the truth on, and of estimates in its frame, one drawing each.

    Parameters
    ----------
    x : (N,) for each pose of the truth: time or way
    found : by name; where an estimate leaves the picture its line ends
    """
    drawings = []
    for axis, name in enumerate("xyz"):
        values = truth.positions[:, axis]
        spare = _OFF * max(float(np.ptp(truth.positions, axis=0).max()), 1.0)
        lines = [Series("truth", x[::_STEP], values[::_STEP] - values[0])]
        for label, trajectory in found.items():
            if trajectory is not None:
                there = trajectory.covers(truth.times)
                y = np.full(len(x), np.nan)
                y[there] = trajectory.interpolate(truth.times[there])[0][:, axis]
                y[(y < values.min() - spare) | (y > values.max() + spare)] = np.nan
                lines.append(Series(label, x[::_STEP], y[::_STEP] - values[0]))
        drawings.append(line_plot(lines, x_label, f"{name} from the start, m"))
    return drawings


def angles_over(
    x: Array, truth: Trajectory, found: Mapping[str, Trajectory | None], x_label: str
) -> list[str]:
    """Draw roll, pitch and yaw in degrees as `positions_over` draws the positions."""
    drawings = []
    true = np.degrees(_angles(truth.quats_xyzw))
    for axis, name in enumerate(("roll", "pitch", "yaw")):
        values = true[:, axis]
        spare = _OFF * max(float(np.ptp(values)), 10.0)
        lines = [Series("truth", x[::_STEP], values[::_STEP])]
        for label, trajectory in found.items():
            if trajectory is not None:
                there = trajectory.covers(truth.times)
                y = np.full(len(x), np.nan)
                turns = _angles(trajectory.interpolate(truth.times[there])[1])[:, axis]
                off = np.degrees(turns) - values[there]
                y[there] = values[there] + (off + 180.0) % 360.0 - 180.0
                y[(y < values.min() - spare) | (y > values.max() + spare)] = np.nan
                lines.append(Series(label, x[::_STEP], y[::_STEP]))
        drawings.append(line_plot(lines, x_label, f"{name}, °"))
    return drawings


def _angles(quats: Array) -> Array:
    """Roll, pitch and yaw (N, 3) rad, the yaw unwrapped."""
    R = geometry.to_matrices(quats)
    pitch = np.arcsin(np.clip(-R[:, 2, 0], -1.0, 1.0))
    roll, yaw = np.arctan2(R[:, 2, 1], R[:, 2, 2]), np.arctan2(R[:, 1, 0], R[:, 0, 0])
    return np.stack([roll, pitch, np.unwrap(yaw)], axis=1)


def oblique_map(
    points: NDArray[np.float32], path: Array | None, ceiling: float | None = None
) -> str:
    """Draw a map by height from 35° above, without what is higher than `ceiling` (m)."""
    cloud = _below(points, ceiling)
    if not len(cloud):
        return '<p class="none">No points were mapped.</p>'
    return oblique_view(cloud, cloud[:, 2], "height, m", path=path)


def map_from_above(
    points: NDArray[np.float32], path: Array | None, ceiling: float | None = None
) -> str:
    """Draw a map by height from above, as `oblique_map`."""
    cloud = _below(points, ceiling)
    if not len(cloud):
        return '<p class="none">No points were mapped.</p>'
    x, y, z = cloud.T
    view = paint(project(x, y, z, width=900, max_height=800), z, table=HEIGHT)
    way = None if path is None else Way(path[:, 0], path[:, 1])
    return map_view(view, "height, m", HEIGHT, way=way, name="map from above")


def _below(points: NDArray[np.float32], ceiling: float | None) -> Array:
    cloud = points.astype(np.float64)
    return cloud if ceiling is None else cloud[cloud[:, 2] < ceiling]
