# SPDX-License-Identifier: MIT OR Apache-2.0
"""Searches in scipy's tree on all cores, which an interrupt may end at any moment.

The tree's own threads go on behind an interrupt, in arrays that are gone by then, and crash the process.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, TypeVar

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray
    from scipy.spatial import cKDTree

_Found = TypeVar("_Found")
_TOGETHER = 10_000  # points that a thread searches for at a time
_FEW = 200


def nearest(
    tree: cKDTree, points: NDArray[np.float64], k: Sequence[int], limit: float = np.inf
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return the distances (N, K) and indices (N, K) of some of the nearest.

    Parameters
    ----------
    points : (N, D)
    k : (K,) which of the nearest, from 1
    limit : beyond it there is none: the distance is infinite, the index the number of the tree's points
    """
    parts = _in_parts(points, lambda part: tree.query(part, k=[*k], distance_upper_bound=limit))
    return np.concatenate([d for d, _ in parts]), np.concatenate([i for _, i in parts])


def within(tree: cKDTree, points: NDArray[np.float64], radius: float) -> Iterator[list[int]]:
    """Yield the indices of all within a radius of each point (N, D), increasing.

    Some points at a time: in a dense cloud each has thousands of neighbours.
    """
    for i in range(0, len(points), _FEW):
        yield from tree.query_ball_point(points[i : i + _FEW], radius, return_sorted=True)


def _in_parts(
    points: NDArray[np.float64], search: Callable[[NDArray[np.float64]], _Found]
) -> list[_Found]:
    starts = range(0, max(1, len(points)), _TOGETHER)
    # Leaving it waits for the threads, also behind an interrupt.
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        return list(threads.map(search, (points[i : i + _TOGETHER] for i in starts)))
