# SPDX-License-Identifier: MIT OR Apache-2.0
"""Sums of rows by key, of more rows than fit into memory."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.voxels import by_key

if TYPE_CHECKING:
    from numpy.typing import NDArray


class KeySums:
    """Sums of rows with equal keys.

    Sorted runs, merged whenever a newer one has half an older's size.
    """

    def __init__(self) -> None:
        self._runs: list[tuple[NDArray[np.int64], NDArray[np.float64]]] = []

    def __len__(self) -> int:
        """Return how many sums are held: as many as keys, or more where runs are not yet merged."""
        return sum(len(keys) for keys, _ in self._runs)

    def add(self, keys: NDArray[np.int64], rows: NDArray[np.float64]) -> None:
        """Add rows (N, C) to the sums of keys (N,)."""
        if not len(keys):
            return
        run = _summed(keys, rows)
        while self._runs and len(self._runs[-1][0]) <= 2 * len(run[0]):
            older = self._runs.pop()
            run = _summed(*(np.concatenate(pair) for pair in zip(older, run, strict=True)))
        self._runs.append(run)

    def result(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the keys (K,) in order and their sums (K, C), of which there must be some."""
        if len(self._runs) > 1:
            columns = (np.concatenate(column) for column in zip(*self._runs, strict=True))
            self._runs = [_summed(*columns)]
        return self._runs[0]


def _summed(
    keys: NDArray[np.int64], sums: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    order, starts = by_key(keys)
    return keys[order][starts], np.add.reduceat(sums[order], starts)
