# SPDX-License-Identifier: MIT OR Apache-2.0
"""Points averaged by voxels: the cloud that is described, and the surfels that are compared."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_BITS = 21
_HALF = 1 << (_BITS - 1)
_SIDED = 0.4  # planarity from which a surfel has two sides
_MIN_POINTS = 6  # of a surfel: as many as its moments have numbers


@dataclass(frozen=True, slots=True)
class Surfels:
    """Means and covariances of the points in voxels.

    Attributes
    ----------
    means : (S, 3) m, map frame
    covariances : (S, 3, 3) m²
    normals : (S, 3) unit, direction of least extent; towards the sensor if `signed`, else of
        either sign
    planarity : (S,) 2 (λ2 − λ1) / (λ1 + λ2 + λ3): 1 for a disc, 0 for a line or a ball
    """

    means: NDArray[np.float64]
    covariances: NDArray[np.float64]
    normals: NDArray[np.float64]
    planarity: NDArray[np.float64]
    signed: bool = False

    def __len__(self) -> int:
        return len(self.means)

    def __getitem__(self, rows: NDArray[np.intp] | NDArray[np.bool_] | slice) -> Surfels:
        return Surfels(
            self.means[rows],
            self.covariances[rows],
            self.normals[rows],
            self.planarity[rows],
            self.signed,
        )


def voxel_keys(points: NDArray[np.float64], size: float) -> NDArray[np.int64]:
    """Whole numbers (N,) that are equal for points of the same voxel; up to ±1,000,000 voxels."""
    cells = np.floor(points / size).astype(np.int64) + _HALF
    keys: NDArray[np.int64] = (cells[:, 0] << (2 * _BITS)) | (cells[:, 1] << _BITS) | cells[:, 2]
    return keys


def voxel_means(points: NDArray[np.float64], size: float) -> NDArray[np.float64]:
    """Average (V, 3) of the points in each voxel of edge `size`, ordered by voxel."""
    order, starts, counts = _groups(points, size)
    return np.add.reduceat(points[order], starts, axis=0) / counts[:, None]


def opposed(a: Surfels, b: Surfels, R: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether surfels (S,) of b, turned by R, are the other side of a thin wall than those of a."""
    if not (a.signed and b.signed):
        return np.zeros(len(a), dtype=np.bool_)
    cosines = np.einsum("ni,ij,nj->n", a.normals, R, b.normals)
    planes = np.minimum(a.planarity, b.planarity) > _SIDED
    other: NDArray[np.bool_] = planes & (cosines < -0.5)
    return other


def surfels_of(
    points: NDArray[np.float64], size: float, origins: NDArray[np.float64] | None = None
) -> Surfels:
    """Moments of the points in each voxel of edge `size` that holds enough of them.

    Normals are turned towards `origins` (N, 3), where these are known: else two places that saw a
    wall from its two sides would be pulled together by its thickness.
    """
    order, starts, counts = _groups(points, size)
    means = np.add.reduceat(points[order], starts, axis=0) / counts[:, None]
    centred = points[order] - np.repeat(means, counts, axis=0)
    rows, columns = (0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2)
    products = np.stack([centred[:, i] * centred[:, j] for i, j in zip(rows, columns, strict=True)])
    sums = np.add.reduceat(products, starts, axis=1) / counts
    enough = counts >= _MIN_POINTS
    covariances = np.empty((int(enough.sum()), 3, 3))
    for (i, j), values in zip(zip(rows, columns, strict=True), sums[:, enough], strict=True):
        covariances[:, i, j] = covariances[:, j, i] = values
    surfels = moments_to_surfels(means[enough], covariances)
    if origins is None:
        return surfels
    seen_from = (np.add.reduceat(origins[order], starts, axis=0) / counts[:, None])[enough]
    away = np.einsum("ni,ni->n", surfels.normals, seen_from - surfels.means) < 0
    normals = np.where(away[:, None], -surfels.normals, surfels.normals)
    return replace(surfels, normals=normals, signed=True)


def moments_to_surfels(means: NDArray[np.float64], covariances: NDArray[np.float64]) -> Surfels:
    """Find normals and planarity from the covariances' eigenvalues."""
    values, vectors = np.linalg.eigh(covariances)
    total = np.maximum(values.sum(axis=1), 1e-12)
    planarity = 2.0 * (values[:, 1] - np.maximum(values[:, 0], 0.0)) / total
    return Surfels(means, covariances, np.ascontiguousarray(vectors[:, :, 0]), planarity)


def _groups(
    points: NDArray[np.float64], size: float
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Order that brings voxels together, where each begins, and how many points it has."""
    keys = voxel_keys(points, size)
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    starts = np.flatnonzero(np.concatenate([[True], ordered[1:] != ordered[:-1]]))
    return order, starts, np.diff(np.append(starts, len(keys)))
