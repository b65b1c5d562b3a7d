# SPDX-License-Identifier: MIT OR Apache-2.0
"""Through which cells of a level grid beams have passed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.products.cell_sums import cells_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_MOST = 100_000  # beams of a part that are followed, evenly
_TOGETHER = 2_000_000  # places along beams that are looked at at once


class Passages:
    """Counts the beams through every cell.

    Parameters
    ----------
    corner : (2,) m, lower left corner of the grid
    shape : rows, upwards, and columns
    cell : m, edge of a cell
    """

    def __init__(self, corner: Array, shape: tuple[int, int], cell: float) -> None:
        self._corner, self._shape, self._cell = corner, shape, cell
        self.counts = np.zeros(shape, np.int64)

    def counted(self, places: Array, weights: NDArray[np.int64] | None = None) -> NDArray[np.int64]:
        """Return how many places (N, 2) m are in each cell (H, W)."""
        at, inside = cells_at(places, self._corner, self._shape, self._cell)
        kept = None if weights is None else weights[inside]
        flat = np.bincount(at, kept, minlength=self._shape[0] * self._shape[1])
        return flat.astype(np.int64).reshape(self._shape)

    def add(self, sensors: Array, points: Array, heights: tuple[float, float]) -> None:
        """Follow beams as far as they are within a band of heights, up to a cell before their points.

        Parameters
        ----------
        sensors, points : (N, 3) m, both ends of each beam; those with NaN are left out
        heights : m, lower and upper end of the band
        """
        every = slice(None, None, len(points) // _MOST + 1)
        start, way = sensors[every], points[every] - sensors[every]
        known = np.isfinite(start[:, 0])
        start, way = start[known], way[known]
        level = np.hypot(way[:, 0], way[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = np.sort((np.array(heights) - start[:, 2:]) / way[:, 2:], axis=1)
            before_end = 1.0 - self._cell / level
        first = np.clip(np.nan_to_num(crossing[:, 0], nan=0.0), 0.0, 1.0)
        last = np.minimum(np.clip(np.nan_to_num(crossing[:, 1], nan=1.0), 0.0, 1.0), before_end)
        runs = np.flatnonzero((last - first) * level > 0.5 * self._cell)
        n = np.ceil((last - first)[runs] * level[runs] / (0.5 * self._cell)).astype(np.intp)
        for part in _in_parts(n):
            beam = np.repeat(part, n[part])
            step = np.arange(len(beam)) - np.repeat(np.cumsum(n[part]) - n[part], n[part])
            at = runs[beam]
            share = first[at] + (last - first)[at] * (step + 0.5) / n[beam]
            self.counts += self.counted(start[at, :2] + share[:, None] * way[at, :2])


def _in_parts(n: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Divide beams with `n` places each so that no part has many more than `_TOGETHER`."""
    part = np.cumsum(n) // _TOGETHER
    return np.split(np.arange(len(n)), np.flatnonzero(np.diff(part)) + 1)
