# SPDX-License-Identifier: MIT OR Apache-2.0
"""How densely a wall is covered with points (Tazir 2020, figures 6 and 11)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def wall_density(
    points: NDArray[np.float64],
    axis: int,
    at: float,
    *,
    limits: tuple[tuple[float, float], tuple[float, float]],
    cell: float,
    thickness: float = 0.2,
) -> NDArray[np.float64]:
    """Count the points on a wall that is perpendicular to an axis.

    Parameters
    ----------
    points : (N, 3) float64, m
    axis : 0, 1 or 2, across the wall
    at : m, of the wall along the axis
    limits : m, first and last coordinate along the two other axes, in their order
    cell : m, edge of the squares that are counted
    thickness : m, of points that still belong to the wall, on either side

    Returns
    -------
    (A, B) float64, points per m²
    """
    on_wall = points[np.abs(points[:, axis] - at) < thickness]
    along = np.delete(on_wall, axis, axis=1)
    edges = [np.arange(a, b + 0.5 * cell, cell) for a, b in limits]
    counts, *_ = np.histogram2d(along[:, 0], along[:, 1], bins=edges)
    density: NDArray[np.float64] = counts / cell**2
    return density
