# SPDX-License-Identifier: MIT OR Apache-2.0
"""Mean and covariance of the points in every voxel, of a cloud that is never in memory as a whole."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.map.thin import voxel_cells, voxel_keys

if TYPE_CHECKING:
    from numpy.typing import NDArray

_ROWS, _COLUMNS = np.triu_indices(3)


class VoxelMoments:
    """Sums per voxel, in sorted runs that are merged whenever a newer one has half an older's size.

    Parameters
    ----------
    edge : m, of the voxels
    """

    def __init__(self, edge: float) -> None:
        self._edge = edge
        self._runs: list[tuple[NDArray[np.int64], NDArray[np.float64]]] = []

    def add(self, points: NDArray[np.float64]) -> None:
        """Add points (N, 3) m."""
        if not len(points):
            return
        local = self._local(points)
        squares = local[:, _ROWS] * local[:, _COLUMNS]
        self._append(points, np.hstack([np.ones((len(points), 1)), local, squares]))

    def add_moments(
        self,
        counts: NDArray[np.int64],
        means: NDArray[np.float64],
        covariances: NDArray[np.float64],
    ) -> None:
        """Add what `result` of finer voxels, of which a whole number fills one of these, returned."""
        if not len(counts):
            return
        local, n = self._local(means), counts[:, None].astype(np.float64)
        squares = covariances[:, _ROWS, _COLUMNS] + local[:, _ROWS] * local[:, _COLUMNS]
        self._append(means, np.hstack([n, n * local, n * squares]))

    def _local(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points relative to the centres of their voxels, so that squares keep their precision."""
        local: NDArray[np.float64] = points - (np.floor(points / self._edge) + 0.5) * self._edge
        return local

    def _append(self, points: NDArray[np.float64], sums: NDArray[np.float64]) -> None:
        run = _summed(voxel_keys(points, self._edge), sums)
        while self._runs and len(self._runs[-1][0]) <= 2 * len(run[0]):
            older = self._runs.pop()
            run = _summed(*(np.concatenate(pair) for pair in zip(older, run, strict=True)))
        self._runs.append(run)

    def result(self) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Return counts (K,), means (K, 3) and covariances (K, 3, 3) by rising key of the voxel."""
        if not self._runs:
            return np.empty(0, np.int64), np.empty((0, 3)), np.empty((0, 3, 3))
        keys, sums = _summed(*(np.concatenate(column) for column in zip(*self._runs, strict=True)))
        n, local = sums[:, :1], sums[:, 1:4] / sums[:, :1]
        covariances = np.empty((len(keys), 3, 3))
        covariances[:, _ROWS, _COLUMNS] = sums[:, 4:] / n
        covariances[:, _COLUMNS, _ROWS] = covariances[:, _ROWS, _COLUMNS]
        covariances -= local[:, :, None] * local[:, None, :]
        centres = (voxel_cells(keys) + 0.5) * self._edge
        return n[:, 0].astype(np.int64), centres + local, covariances


def _summed(
    keys: NDArray[np.int64], sums: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    starts = np.flatnonzero(np.append(True, keys[1:] != keys[:-1]))
    return keys[starts], np.add.reduceat(sums[order], starts)
