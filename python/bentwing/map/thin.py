# SPDX-License-Identifier: MIT OR Apache-2.0
"""At most one point per voxel, on a stream and in bounded memory."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from bentwing.map.chunk import MapChunk

# Bits per axis of a voxel's number: at 1 cm it repeats after 21 km, beyond any single map.
_BITS = 21
_MASK = (1 << _BITS) - 1


def thin(
    chunks: Iterable[MapChunk], spacing: float, counts: dict[str, int] | None = None
) -> Iterator[MapChunk]:
    """Keep the first point in every voxel of `spacing` metres; 0 keeps all points.

    All points are the default of a map, because one point per voxel smaller than a few times the
    range noise flattens the distribution of the noise and makes walls look thicker than measured.

    Parameters
    ----------
    chunks : stream of map chunks
    spacing : m, edge of the voxels
    counts : receives `map.thinned`, the points left out

    Raises
    ------
    UsageError
        If the spacing is negative or not finite.
    """
    if not (np.isfinite(spacing) and spacing >= 0):
        msg = (
            f"map spacing {spacing} m cannot be used; give a length in metres, or 0 for all points"
        )
        raise UsageError(msg)
    return _thinned(chunks, spacing, {} if counts is None else counts)


def _thinned(
    chunks: Iterable[MapChunk], spacing: float, counts: dict[str, int]
) -> Iterator[MapChunk]:
    counts.setdefault("map.thinned", 0)
    seen = VoxelSet()
    for chunk in chunks:
        keep = seen.add(voxel_keys(chunk.points, spacing)) if spacing else slice(None)
        kept = chunk.where(keep)
        counts["map.thinned"] += len(chunk) - len(kept)
        if len(kept):
            yield kept


def voxel_keys(points: NDArray[np.float64], edge: float) -> NDArray[np.int64]:
    """Return the number `(N,)` of the voxel of each point, unique within 2²¹ voxels along each axis."""
    cells = np.floor(points / edge).astype(np.int64) & _MASK
    keys: NDArray[np.int64] = (cells[:, 0] << 2 * _BITS) | (cells[:, 1] << _BITS) | cells[:, 2]
    return keys


def voxel_cells(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the cells `(N, 3)` of the numbers of voxels, of those nearest to the origin."""
    cells = np.stack([keys >> 2 * _BITS, keys >> _BITS, keys], axis=1) & _MASK
    return cells - ((cells >> (_BITS - 1)) << _BITS)


class VoxelSet:
    """Set of int64 keys that grows by whole arrays, at 8 bytes per key.

    Sorted runs, merged whenever the newer of two has reached half the size of the older: a key is
    moved O(log n) times and looked up in O(log n) runs.
    """

    def __init__(self) -> None:
        self._runs: list[NDArray[np.int64]] = []

    def __len__(self) -> int:
        return sum(map(len, self._runs))

    def add(self, keys: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Add keys `(N,)`; True where a key was not there before, at its first occurrence."""
        unique, first = np.unique(keys, return_index=True)
        new = ~self.contains(unique)
        added = np.zeros(len(keys), dtype=np.bool_)
        added[first[new]] = True
        self._append(unique[new])
        return added

    def contains(self, keys: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether each of keys `(N,)` is there."""
        there = np.zeros(len(keys), dtype=np.bool_)
        for run in self._runs:
            at = np.minimum(np.searchsorted(run, keys), len(run) - 1)
            there |= run[at] == keys
        return there

    def _append(self, run: NDArray[np.int64]) -> None:
        if not len(run):
            return
        while self._runs and len(self._runs[-1]) <= 2 * len(run):
            run = np.concatenate([self._runs.pop(), run])
            run.sort(kind="stable")  # two sorted halves are merged in linear time
        self._runs.append(run)
