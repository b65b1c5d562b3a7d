# SPDX-License-Identifier: MIT OR Apache-2.0
"""Mean and covariance of groups of points, and the planes that they lie on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.key_sums import KeySums
from bentwing.base.voxels import cells_of, centres_of, pack, unpack

if TYPE_CHECKING:
    from numpy.typing import NDArray

_ROWS, _COLUMNS = np.triu_indices(3)


@dataclass(frozen=True, slots=True)
class Moments:
    """Counts, means and covariances of groups of points.

    Attributes
    ----------
    counts : (K,) points
    means : (K, 3) m
    covariances : (K, 3, 3) m²
    """

    counts: NDArray[np.int64]
    means: NDArray[np.float64]
    covariances: NDArray[np.float64]

    @classmethod
    def of_groups(cls, points: NDArray[np.float64], starts: NDArray[np.intp]) -> Moments:
        """Take points (N, 3) m in groups, none of them empty, that begin at rows `starts` (K,)."""
        counts = np.diff(np.append(starts, len(points)))
        means = np.add.reduceat(points, starts, axis=0) / counts[:, None]
        centred = points - np.repeat(means, counts, axis=0)
        products = np.stack(
            [centred[:, i] * centred[:, j] for i, j in zip(_ROWS, _COLUMNS, strict=True)]
        )
        return cls(counts, means, _symmetric(np.add.reduceat(products, starts, axis=1) / counts))

    def __getitem__(self, rows: NDArray[np.bool_]) -> Moments:
        return Moments(self.counts[rows], self.means[rows], self.covariances[rows])


@dataclass(frozen=True, slots=True)
class Planes:
    """Planes through the means of points, by their covariances.

    Attributes
    ----------
    normals : (K, 3) unit, of either sign: the directions of least extent
    variances : (K, 3) m², along the principal directions, increasing and not negative
    """

    normals: NDArray[np.float64]
    variances: NDArray[np.float64]

    @classmethod
    def of(cls, covariances: NDArray[np.float64]) -> Planes:
        """Find the planes of covariances (K, 3, 3) m²."""
        variances, directions = np.linalg.eigh(covariances)
        return cls(np.ascontiguousarray(directions[:, :, 0]), np.maximum(variances, 0.0))

    @property
    def thickness(self) -> NDArray[np.float64]:
        """(K,) m, standard deviation across the plane."""
        return np.sqrt(self.variances[:, 0])

    @property
    def width(self) -> NDArray[np.float64]:
        """(K,) m, the smaller standard deviation along the plane."""
        return np.sqrt(self.variances[:, 1])

    @property
    def planarity(self) -> NDArray[np.float64]:
        """(K,) 2 (λ2 - λ1) / (λ1 + λ2 + λ3): 1 for a disc, 0 for a line or a ball."""
        least, middle, _ = self.variances.T
        shares: NDArray[np.float64] = (middle - least) / np.maximum(
            self.variances.sum(axis=1), 1e-12
        )
        return 2.0 * shares


class VoxelMoments:
    """Moments of the points in every voxel, of a cloud that is never in memory as a whole.

    Parameters
    ----------
    edge : m, of the voxels
    """

    def __init__(self, edge: float) -> None:
        self._edge = edge
        self._sums = KeySums()

    def add(self, points: NDArray[np.float64]) -> None:
        """Add points (N, 3) m."""
        self._add(points, np.ones((len(points), 1)), 0.0)

    def add_moments(self, finer: Moments) -> None:
        """Add what `result` of finer voxels, of which a whole number fills one of these, returned."""
        n = finer.counts[:, None].astype(np.float64)
        self._add(finer.means, n, finer.covariances[:, _ROWS, _COLUMNS])

    def _add(
        self,
        means: NDArray[np.float64],
        n: NDArray[np.float64],
        spread: NDArray[np.float64] | float,
    ) -> None:
        if not len(means):
            return
        cells = cells_of(means, self._edge)
        # relative to the centres of the voxels, so that squares keep their precision
        local = means - centres_of(cells, self._edge)
        squares = spread + local[:, _ROWS] * local[:, _COLUMNS]
        self._sums.add(pack(cells), np.hstack([n, n * local, n * squares]))

    def result(self) -> Moments:
        """Return the moments of the voxels in the order of their keys."""
        if not len(self._sums):
            return Moments(np.empty(0, np.int64), np.empty((0, 3)), np.empty((0, 3, 3)))
        keys, sums = self._sums.result()
        n, local = sums[:, :1], sums[:, 1:4] / sums[:, :1]
        covariances = _symmetric((sums[:, 4:] / n).T) - local[:, :, None] * local[:, None, :]
        centres = centres_of(unpack(keys), self._edge)
        return Moments(n[:, 0].astype(np.int64), centres + local, covariances)


def _symmetric(six: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrices (K, 3, 3) whose upper triangles are the columns of (6, K)."""
    matrices = np.empty((six.shape[1], 3, 3))
    matrices[:, _ROWS, _COLUMNS] = matrices[:, _COLUMNS, _ROWS] = six.T
    return matrices
