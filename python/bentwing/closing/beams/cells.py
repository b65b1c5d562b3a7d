# SPDX-License-Identifier: MIT OR Apache-2.0
"""Cells of the map whose points lie in planes, each seen at several times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.moments import Moments
from bentwing.base.value import Value
from bentwing.base.voxels import by_key, voxel_keys

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

EDGE = 1.0
"""m, of a cell."""
MIN_POINTS = 15
MIN_SPAN = 0.3
"""s, between the first and the last look at a cell."""
MAX_ROUGHNESS, MIN_WIDTH = 0.2, 0.12
"""Standard deviations across and along a plane, in edges: of the first iteration, and of all."""
LAST_ROUGHNESS = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Cells(Value):
    """Points in planes.

    Attributes
    ----------
    chosen : (M,) which points
    cells : (M,) number of the cell of each
    normals : (M, 3) of its cell
    across : (M,) m, how far it is off the plane
    along : (M, 2) m, where it is in the plane
    roughness : (M,) m, standard deviation across the plane of its cell
    n_cells : how many cells there are
    """

    chosen: NDArray[np.intp]
    cells: NDArray[np.intp]
    normals: Array
    across: Array
    along: Array
    roughness: Array
    n_cells: int


def find_cells(points: Array, times: Array, iteration: int) -> Cells:
    """Sort points (N, 3) m, seen at `times` (N,) s, into cells; flatter ones iteration by iteration."""
    order, starts = by_key(voxel_keys(points, EDGE))
    moments = Moments.of_groups(points[order], starts)
    variances, axes = np.linalg.eigh(moments.covariances)
    across, along = np.sqrt(np.maximum(variances[:, :2].T, 0.0))
    spans = np.maximum.reduceat(times[order], starts) - np.minimum.reduceat(times[order], starts)
    is_plane = (
        (moments.counts >= MIN_POINTS)
        & (across < EDGE * max(LAST_ROUGHNESS, MAX_ROUGHNESS / (iteration + 1)))
        & (along > EDGE * MIN_WIDTH)
        & (spans > MIN_SPAN)
    )
    number = np.where(is_plane, np.cumsum(is_plane) - 1, -1)
    of_point = np.repeat(np.arange(len(starts)), moments.counts)
    keep = is_plane[of_point]
    chosen, of_point = order[keep], of_point[keep]
    offsets = points[chosen] - moments.means[of_point]
    local = np.einsum("mij,mi->mj", axes[of_point], offsets)
    return Cells(
        chosen,
        number[of_point],
        axes[of_point, :, 0],
        local[:, 0],
        local[:, 1:],
        across[of_point],
        int(is_plane.sum()),
    )
