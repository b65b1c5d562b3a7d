# SPDX-License-Identifier: MIT OR Apache-2.0
"""Cubic voxels: cells, their keys, and sets of them.

Voxel (i, j, k) of edge e holds the points with `i e ≤ x < (i + 1) e`, and so on: below zero as above it.
Its key is one int64, with 21 bits for each axis. Keys are in the order of the cells, x first, and repeat
after 2²¹ voxels along an axis, at 1 cm after 21 km: beyond any single map.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_BITS = 21
_MASK = (1 << _BITS) - 1
_HALF = 1 << (_BITS - 1)


def cells_of(points: NDArray[np.float64], edge: float) -> NDArray[np.int64]:
    """Return the cells `(N, 3)` of points `(N, 3)`."""
    return np.floor(points / edge).astype(np.int64)


def centres_of(cells: NDArray[np.int64], edge: float) -> NDArray[np.float64]:
    """Return the centres `(N, 3)` of cells `(N, 3)`."""
    centres: NDArray[np.float64] = (cells.astype(np.float64) + 0.5) * edge
    return centres


def pack(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the keys `(N,)` of cells `(N, 3)`."""
    x, y, z = ((cells + _HALF) & _MASK).T
    keys: NDArray[np.int64] = (x << 2 * _BITS) | (y << _BITS) | z
    return keys


def unpack(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the cells `(N, 3)` of keys `(N,)`: from -2²⁰ up to 2²⁰ - 1 along each axis."""
    return (np.stack([keys >> 2 * _BITS, keys >> _BITS, keys], axis=1) & _MASK) - _HALF


def voxel_keys(points: NDArray[np.float64], edge: float) -> NDArray[np.int64]:
    """Return the keys `(N,)` of the voxels of points `(N, 3)`."""
    keys = np.zeros(len(points), np.int64)
    for values in points.T:  # one axis after the other stays in the cache
        keys <<= _BITS
        keys |= (np.floor(values / edge).astype(np.int64) + _HALF) & _MASK
    return keys


def column_keys(points: NDArray[np.float64], edge: float) -> NDArray[np.int64]:
    """Return keys `(N,)` that are the same for points `(N, 3)` above each other."""
    return voxel_keys(points * np.array([1.0, 1.0, 0.0]), edge)


def by_key(
    keys: NDArray[np.int64], times: NDArray[np.float64] | None = None
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the order `(N,)` that brings equal keys together, and where each of them begins in it.

    Parameters
    ----------
    keys : (N,)
    times : (N,) that order what has equal keys; default: the order in which they come
    """
    if times is not None and (times[1:] < times[:-1]).any():
        earlier = np.argsort(times, kind="stable")
        order, starts = by_key(keys[earlier])
        return earlier[order], starts
    n_bits = len(keys).bit_length()
    narrow = _narrowed(keys, 63 - n_bits)
    if narrow is None:
        order = np.argsort(keys, kind="stable")
        ordered = keys[order]
    else:
        # A key and its place in one number: to sort numbers takes a third of the time of sorting places.
        ordered = narrow << n_bits | np.arange(len(keys))
        ordered.sort()
        order = ordered & ((1 << n_bits) - 1)
        ordered >>= n_bits
    return order, np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1])[: len(keys)])


def _narrowed(keys: NDArray[np.int64], n_bits: int) -> NDArray[np.int64] | None:
    """Return numbers from 0 in the order of the keys, or None if they need more bits."""
    if not len(keys):
        return keys
    low, high = int(keys.min()), int(keys.max())
    if high - low < 1 << n_bits:
        return keys - low
    if low < 0:  # no voxels'
        return None
    narrow, n = np.zeros_like(keys), 1
    for shift in (2 * _BITS, _BITS, 0):
        axis = (keys >> shift) & _MASK
        first = axis.min()
        size = int(axis.max() - first) + 1
        narrow *= size
        narrow += axis - first
        n *= size
        if n > 1 << n_bits:
            return None
    return narrow


class VoxelSet:
    """Set of keys that grows by whole arrays, at 8 bytes per key.

    Sorted runs, merged whenever the newer of two has reached half the size of the older: a key is
    moved O(log n) times and looked up in O(log n) runs.
    """

    def __init__(self) -> None:
        self._runs: list[NDArray[np.int64]] = []

    def __len__(self) -> int:
        return sum(map(len, self._runs))

    def add(self, keys: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Add keys `(N,)`; True where a key was not there before, at its first occurrence."""
        order, starts = by_key(keys)
        first = order[starts]
        unique = keys[first]
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
