# SPDX-License-Identifier: MIT OR Apache-2.0
"""How high the floor is on which a site stands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.moments import VoxelMoments
from bentwing.base.voxels import cells_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

EDGE = 0.25  # m, of the columns whose lowest points are looked at
_BAND = 0.1  # m of height within which the columns of one floor lie
_FLAT = np.array([1.0, 1.0, EDGE / _BAND])  # makes cubes of voxels that are so flat
_NEAR = 3.0  # m from the way within which the floor is looked for
_FEWEST = 3  # points that make a surface in a column


def lowest_surfaces(parts: Iterable[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return a point (K, 3) m of the lowest surface in every column.

    Parameters
    ----------
    parts : (N, 3) m each, of a cloud that is never in memory as a whole
    """
    moments = VoxelMoments(EDGE)
    for points in parts:
        moments.add(points * _FLAT)
    found = moments.result()
    means = found.means[found.counts >= _FEWEST]  # in order of x, y and z
    _, first = np.unique(cells_of(means, EDGE)[:, :2], axis=0, return_index=True)
    lowest: NDArray[np.float64] = means[first] / _FLAT
    return lowest


def floor_height(
    lowest: NDArray[np.float64], way: NDArray[np.float64] | None = None
) -> float | None:
    """Return the height, m, at which most columns have their lowest surface; None without any.

    Parameters
    ----------
    lowest : (K, 3) m, of each column
    way : (M, 3) m, of the sensor; where it is known, only columns near it count, and only below it
    """
    chosen = lowest[:, 2]
    if way is not None and len(way) and len(lowest):
        from scipy.spatial import cKDTree  # slow to import

        distances, at = cKDTree(way[:, :2]).query(lowest[:, :2])
        below = chosen[(distances < _NEAR) & (chosen < way[at, 2])]
        chosen = below if len(below) else chosen
    if not len(chosen):
        return None
    heights = np.sort(chosen)
    ends = np.searchsorted(heights, heights + _BAND, side="right")
    first = int(np.argmax(ends - np.arange(len(heights))))
    return float(heights[first : ends[first]].mean())
