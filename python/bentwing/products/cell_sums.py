# SPDX-License-Identifier: MIT OR Apache-2.0
"""Counts, means and standard deviations of values in the cells of a grid, on a stream."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


class CellSums:
    """Sums of the values of points by cells of a level grid.

    Parameters
    ----------
    origin : (2,) m, lower left corner
    shape : rows, upwards, and columns
    cell : m, edge of a cell
    """

    def __init__(self, origin: Array, shape: tuple[int, int], cell: float) -> None:
        self.origin, self.shape, self.cell = origin, shape, cell
        self.counts = np.zeros(shape, np.int64)
        self._sums, self._squares = np.zeros(shape), np.zeros(shape)

    def add(self, places: Array, values: Array) -> None:
        """Take values (N,) at places (N, 2) m; those outside the grid are left out."""
        at, inside = cells_at(places, self.origin, self.shape, self.cell)
        kept, n = values[inside], self.shape[0] * self.shape[1]
        self.counts += np.bincount(at, minlength=n).reshape(self.shape)
        self._sums += np.bincount(at, kept, minlength=n).reshape(self.shape)
        self._squares += np.bincount(at, kept**2, minlength=n).reshape(self.shape)

    def result(self) -> tuple[Array, Array]:
        """Return means and standard deviations (H, W); NaN where there is no value."""
        n = np.where(self.counts > 0, self.counts, np.nan)
        means = self._sums / n
        return means, np.sqrt(np.maximum(self._squares / n - means**2, 0.0))


def grid_of(places: Array, cell: float) -> tuple[Array, tuple[int, int]]:
    """Return corner (2,) m and shape of the grid of round cells that holds places (N, 2) m."""
    low, high = np.floor(places.min(axis=0) / cell), np.floor(places.max(axis=0) / cell)
    width, height = (high - low).astype(int) + 1
    return low * cell, (int(height), int(width))


def cells_at(
    places: Array, origin: Array, shape: tuple[int, int], cell: float
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Return the flat numbers of the cells of places (N, 2) m in a grid, and which are in it."""
    column, row = np.floor((places - origin) / cell).astype(np.intp).T
    height, width = shape
    inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
    return row[inside] * width + column[inside], inside


def centres_of(origin: Array, shape: tuple[int, ...], cell: float) -> Array:
    """Return the centres (H, W, 2) m of the cells of a grid."""
    height, width = shape
    x = origin[0] + (np.arange(width) + 0.5) * cell
    y = origin[1] + (np.arange(height) + 0.5) * cell
    return np.stack(np.meshgrid(x, y), axis=2)
