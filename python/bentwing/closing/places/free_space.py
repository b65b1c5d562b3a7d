# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a place's beams passed through: where another view of the same place has nothing either."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Columns = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]

_MOST_SAMPLES = 600_000  # of all beams together, which bounds what a place holds
_REACH = 40.0  # m, beyond it beams are too far apart to be worth following


@dataclass(frozen=True, slots=True)
class FreeSpace:
    """Voxels that beams passed and no point is in or beside, of a box of voxels.

    Attributes
    ----------
    voxel : m, edge of the voxels
    low : (3,) the box's first voxel
    shape : (3,) of the box
    indices : (F,) increasing, into the box
    """

    voxel: float
    low: tuple[int, ...]
    shape: tuple[int, ...]
    indices: NDArray[np.int32]

    def contains(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether each of `points` (N, 3) lies where the beams met nothing."""
        found = np.zeros(len(points), dtype=np.bool_)
        if len(self.indices):
            columns, inside = _in_box(_cells(points, self.voxel), self.low, self.shape)
            at = np.ravel_multi_index(columns, self.shape)
            nearest = np.minimum(np.searchsorted(self.indices, at), len(self.indices) - 1)
            found[inside] = self.indices[nearest] == at
        return found


def seen_through(
    points: NDArray[np.float64],
    origins: NDArray[np.float64],
    *,
    voxel: float = 0.25,
    most_beams: int = 25_000,
) -> FreeSpace:
    """Follow some of the beams from `origins` to `points`, both (N, 3) m.

    Of larger voxels a parked car hardly shows between those of the floor and the ceiling.

    Parameters
    ----------
    voxel : m, edge of the voxels
    most_beams : that are followed; fewer if they are long
    """
    passed = _along(*_some_beams(points, origins, voxel, most_beams), voxel)
    if not len(passed[0]):
        return FreeSpace(voxel, (0, 0, 0), (0, 0, 0), np.zeros(0, np.int32))
    # with a margin, so that what is beside the box is not beside its other end
    low = tuple(int(column.min()) - 1 for column in passed)
    shape = tuple(int(column.max()) + 2 - first for column, first in zip(passed, low, strict=True))
    filled, free = (np.zeros(shape, dtype=np.bool_) for _ in range(2))
    filled[_in_box(_cells(points, voxel), low, shape)[0]] = True
    free[tuple(column - first for column, first in zip(passed, low, strict=True))] = True
    free &= ~_dilated(filled)
    return FreeSpace(voxel, low, shape, np.flatnonzero(free).astype(np.int32))


def _some_beams(
    points: NDArray[np.float64], origins: NDArray[np.float64], voxel: float, most: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Choose the beams that are followed: their starts and vectors."""
    step = -(-len(points) // most) or 1
    starts, beams = origins[::step], points[::step] - origins[::step]
    n_samples = np.minimum(np.linalg.norm(beams, axis=1), _REACH).sum() / voxel
    fewer = int(np.ceil(n_samples / _MOST_SAMPLES)) or 1
    return starts[::fewer], beams[::fewer]


def _along(starts: NDArray[np.float64], beams: NDArray[np.float64], voxel: float) -> Columns:
    """Find the cells that the beams pass, without their ends."""
    lengths = np.linalg.norm(beams, axis=1)
    counts = (np.minimum(lengths, _REACH) / voxel).astype(np.int64)
    steps = beams / np.maximum(lengths, voxel)[:, None]
    along = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    x, y, z = (
        _floor(np.repeat(starts[:, k] / voxel, counts) + along * np.repeat(steps[:, k], counts))
        for k in range(3)
    )
    return x, y, z


def _cells(points: NDArray[np.float64], voxel: float) -> Columns:
    x, y, z = (_floor(points[:, k] / voxel) for k in range(3))
    return x, y, z


def _floor(values: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.floor(values).astype(np.int64)


def _in_box(
    cells: Columns, low: tuple[int, ...], shape: tuple[int, ...]
) -> tuple[Columns, NDArray[np.bool_]]:
    """Find the cells that are in the box, counted from its first, and which those are."""
    inside = np.ones(len(cells[0]), dtype=np.bool_)
    for column, first, extent in zip(cells, low, shape, strict=True):
        inside &= (column >= first) & (column < first + extent)
    x, y, z = (column[inside] - first for column, first in zip(cells, low, strict=True))
    return (x, y, z), inside


def _dilated(filled: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Voxels and their 26 neighbours, one axis after the other."""
    for axis in range(3):
        before = np.moveaxis(filled, axis, 0)
        after = before.copy()
        after[1:] |= before[:-1]
        after[:-1] |= before[1:]
        filled = np.moveaxis(after, 0, axis)
    return filled
