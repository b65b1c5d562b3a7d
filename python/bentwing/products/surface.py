# SPDX-License-Identifier: MIT OR Apache-2.0
"""Heights of a surface of a map on a grid, measured around what is known of it so far."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import InputError, UsageError
from bentwing.products.cell_sums import CellSums, centres_of, grid_of
from bentwing.products.floor import EDGE, lowest_surfaces
from bentwing.products.ground import Terrain, carried_on

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from bentwing.products.finished_map import FinishedMap

_FEWEST = 4  # points of a cell whose scatter says something
_MOST = 100_000_000  # cells


def require_cell(cell: float) -> None:
    """Refuse an edge of cells that is none.

    Raises
    ------
    UsageError
    """
    if not 0 < cell < np.inf:
        msg = f"--cell {cell} cannot be used; give a length in metres above 0"
        raise UsageError(msg)


def lowest_terrain(source: FinishedMap) -> Terrain:
    """Return the lowest surfaces of the columns of a map.

    Raises
    ------
    InputError
        If no column has one.
    """
    lowest = lowest_surfaces(part.points for part in source.parts())
    if not len(lowest):
        msg = f"{source.path}: has no surface, only single points; give a denser map"
        raise InputError(msg)
    return of_lowest(lowest)


def of_lowest(lowest: NDArray[np.float64]) -> Terrain:
    """Return the heights of the lowest surfaces (K, 3) m of columns."""
    corner, shape = grid_of(lowest[:, :2], EDGE)
    sums = CellSums(corner, shape, EDGE)
    sums.add(lowest[:, :2], lowest[:, 2])
    heights, spread = sums.result()
    return Terrain(heights, np.isfinite(heights), spread, sums.counts, EDGE, corner)


def measured_surface(
    source: FinishedMap, guess: Terrain, cell: float, bands: Sequence[tuple[float, float]]
) -> Terrain:
    """Return the mean heights of the points near a guess of a surface, which gets better with each band.

    Parameters
    ----------
    guess : heights, known wherever the surface is looked for
    cell : m, edge of the cells that are returned
    bands : m below and above the guess within which points are taken, one after the other

    Raises
    ------
    UsageError
        If the grid would be too large.
    """
    height, width = guess.heights.shape
    extent = np.array([width - 0.5, height - 0.5]) * guess.cell
    ends = np.stack([guess.origin, guess.origin + extent])
    corner, shape = grid_of(ends, cell)
    if shape[0] * shape[1] > _MOST:
        msg = (
            f"--cell {cell}: the grid would have {shape[1]} x {shape[0]} cells; give a larger cell"
        )
        raise UsageError(msg)
    for band in bands:
        points = (part.points for part in source.parts())
        guess = _measured(points, guess, CellSums(corner, shape, cell), band)
    return guess


def _measured(
    parts: Iterable[NDArray[np.float64]],
    guess: Terrain,
    sums: CellSums,
    band: tuple[float, float],
) -> Terrain:
    """Average what is left above the guess, so that points may lie anywhere in a cell of a slope."""
    for points in parts:
        above = points[:, 2] - guess.height_at(points[:, :2])
        near = (above >= -band[0]) & (above <= band[1])
        sums.add(points[near, :2], above[near])
    means, sigmas = sums.result()
    measured = sums.counts > 0
    below = guess.height_at(centres_of(sums.origin, sums.shape, sums.cell).reshape(-1, 2)).reshape(
        sums.shape
    )
    known = measured & np.isfinite(below)
    heights = carried_on(np.where(known, below + means, np.nan), sums.cell)
    spread = np.where(known, np.maximum(sigmas, _usual(sigmas, sums.counts)), np.nan)
    return Terrain(heights, known, spread, sums.counts, sums.cell, sums.origin)


def _usual(sigmas: NDArray[np.float64], counts: NDArray[np.int64]) -> float:
    """Return the usual scatter of the points of a cell, for those with too few to tell."""
    enough = counts >= _FEWEST
    if not enough.any():
        return 0.0
    n = counts[enough]
    return float(np.median(sigmas[enough] * np.sqrt(n / (n - 1))))
