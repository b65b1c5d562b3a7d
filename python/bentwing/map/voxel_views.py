# SPDX-License-Identifier: MIT OR Apache-2.0
"""Means of the points in voxels, and from where they were seen, on a stream and in bounded memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.key_sums import KeySums
from bentwing.base.value import Value
from bentwing.base.voxels import cells_of, centres_of, pack, unpack

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.map.chunk import MapChunk

MOST_VOXELS = 2_000_000
"""At 80 bytes each; 5,000 m² of surface at 5 cm."""


@dataclass(frozen=True, slots=True, eq=False)
class Views(Value):
    """Points and the direction in which the sensor was.

    Attributes
    ----------
    points : (K, 3) m
    towards : (K, 3) mean of the unit directions from the points to the sensor
    keys : (K,) of the voxels, increasing
    counts : (K,) points in them
    intensity : (K,) mean; None where no point has any
    """

    points: NDArray[np.float64]
    towards: NDArray[np.float64]
    keys: NDArray[np.int64]
    counts: NDArray[np.float64]
    intensity: NDArray[np.float64] | None


class VoxelViews:
    """Gathers the points of voxels; the edge doubles where there are too many.

    Parameters
    ----------
    edge : m, of the voxels at first
    most : voxels that may be held
    """

    def __init__(self, edge: float, most: int = MOST_VOXELS) -> None:
        self.edge = edge
        self._most = most
        self._sums = KeySums()

    def add(self, chunk: MapChunk, towards: NDArray[np.float64]) -> None:
        """Add points with the unit directions (N, 3) to the sensor, or those of their normals."""
        cells = cells_of(chunk.points, self.edge)
        # relative to the centres of the voxels, so that sums keep their precision
        local = chunk.points - centres_of(cells, self.edge)
        ones = np.ones(len(chunk))
        intensity = np.zeros(len(chunk)) if chunk.intensity is None else chunk.intensity
        self._sums.add(pack(cells), np.column_stack([ones, local, towards, intensity]))
        while len(self._sums) > self._most and len(self._sums.result()[0]) > self._most:
            self._coarsen()

    def result(self) -> Views | None:
        """Return the means of the voxels in the order of their keys; None where there is no point."""
        if not len(self._sums):
            return None
        keys, sums = self._sums.result()
        means = sums[:, 1:] / sums[:, :1]
        points = centres_of(unpack(keys), self.edge) + means[:, :3]
        intensity = means[:, 6] if means[:, 6].any() else None
        return Views(points, means[:, 3:6], keys, sums[:, 0], intensity)

    def _coarsen(self) -> None:
        """Double the edge, so that eight voxels become one."""
        keys, sums = self._sums.result()
        cells = unpack(keys)
        wider = cells // 2
        shift = centres_of(cells, self.edge) - centres_of(wider, 2 * self.edge)
        moved = sums.copy()
        moved[:, 1:4] += sums[:, :1] * shift
        self.edge, self._sums = 2 * self.edge, KeySums()
        self._sums.add(pack(wider), moved)
