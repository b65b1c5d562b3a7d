# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a place's beams passed through: where another view of the same place has nothing either."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.places.cloud import voxel_keys

if TYPE_CHECKING:
    from numpy.typing import NDArray

_VOXEL = 0.4  # m
_MOST_BEAMS = 6000
_REACH = 40.0  # m, beyond it beams are too far apart to be worth following
_AROUND = np.array([(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)], float)


@dataclass(frozen=True, slots=True)
class FreeSpace:
    """Voxels that beams passed and no point is in or beside.

    Attributes
    ----------
    keys : (F,) increasing, see `voxel_keys`
    """

    keys: NDArray[np.int64]

    def contains(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether each of `points` (N, 3) lies where the beams met nothing."""
        return _is_in(voxel_keys(points, _VOXEL), self.keys)


def seen_through(points: NDArray[np.float64], origins: NDArray[np.float64]) -> FreeSpace:
    """Follow some of the beams from `origins` to `points`, both (N, 3) m."""
    step = -(-len(points) // _MOST_BEAMS) or 1
    starts, beams = origins[::step], points[::step] - origins[::step]
    lengths = np.linalg.norm(beams, axis=1)
    counts = (np.minimum(lengths, _REACH) / _VOXEL).astype(np.int64)
    owners = np.repeat(np.arange(len(beams)), counts)
    along = np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)
    shares = (along * _VOXEL / lengths[owners])[:, None]
    passed = _distinct(voxel_keys(starts[owners] + shares * beams[owners], _VOXEL))
    filled = _distinct(voxel_keys(points, _VOXEL))
    return FreeSpace(passed[~_is_in(passed, _dilated(filled))])


def _dilated(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Voxels and their 26 neighbours: a neighbour's key differs by a constant."""
    origin = voxel_keys(np.zeros((1, 3)), 1.0)
    steps = voxel_keys(_AROUND + 0.5, 1.0) - origin
    return _distinct((keys[:, None] + steps).ravel())


def _distinct(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Each key once, increasing; `numpy.unique` hashes them first and takes many times as long."""
    ordered = np.sort(keys)
    return ordered[np.concatenate([[True], ordered[1:] != ordered[:-1]])] if len(keys) else ordered


def _is_in(keys: NDArray[np.int64], ordered: NDArray[np.int64]) -> NDArray[np.bool_]:
    if not len(ordered):
        return np.zeros(len(keys), dtype=np.bool_)
    at = np.minimum(np.searchsorted(ordered, keys), len(ordered) - 1)
    found: NDArray[np.bool_] = ordered[at] == keys
    return found
