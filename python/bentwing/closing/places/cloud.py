# SPDX-License-Identifier: MIT OR Apache-2.0
"""Points averaged by voxels: the cloud that is described, and the surfels that are compared."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.moments import Moments, Planes
from bentwing.base.voxels import by_key, voxel_keys

if TYPE_CHECKING:
    from numpy.typing import NDArray

FLAT = 0.85
"""|n_z| of floors, ceilings and ground: any two upright places agree on them."""
_SIDED = 0.4  # planarity from which a surfel has two sides
_PLANAR = 0.6  # planarity of a plane
_THIN = 0.03  # m, standard deviation of a plane's points across it
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


def voxel_means(points: NDArray[np.float64], size: float) -> NDArray[np.float64]:
    """Average (V, 3) of the points in each voxel of edge `size`, ordered by voxel."""
    order, starts = by_key(voxel_keys(points, size))
    counts = np.diff(np.append(starts, len(points)))
    means: NDArray[np.float64] = np.add.reduceat(points[order], starts, axis=0) / counts[:, None]
    return means


def opposed(a: Surfels, b: Surfels, R: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether surfels (S,) of b, turned by R, are the other side of a thin wall than those of a."""
    if not (a.signed and b.signed):
        return np.zeros(len(a), dtype=np.bool_)
    cosines = np.einsum("ni,ij,nj->n", a.normals, R, b.normals)
    planes = np.minimum(a.planarity, b.planarity) > _SIDED
    other: NDArray[np.bool_] = planes & (cosines < -0.5)
    return other


def is_plane(surfels: Surfels) -> NDArray[np.bool_]:
    """Whether surfels (S,) are thin and extended in two directions."""
    across = np.einsum("ni,nij,nj->n", surfels.normals, surfels.covariances, surfels.normals)
    planes: NDArray[np.bool_] = (surfels.planarity > _PLANAR) & (across < _THIN**2)
    return planes


def surfels_of(
    points: NDArray[np.float64], size: float, origins: NDArray[np.float64] | None = None
) -> Surfels:
    """Moments of the points in each voxel of edge `size` that holds enough of them.

    Normals are turned towards `origins` (N, 3), where these are known: else two places that saw a
    wall from its two sides would be pulled together by its thickness.
    """
    order, starts = by_key(voxel_keys(points, size))
    found = Moments.of_groups(points[order], starts)
    enough = found.counts >= _MIN_POINTS
    surfels = surfels_from(found.means[enough], found.covariances[enough])
    if origins is None:
        return surfels
    seen_from = (np.add.reduceat(origins[order], starts, axis=0) / found.counts[:, None])[enough]
    away = np.einsum("ni,ni->n", surfels.normals, seen_from - surfels.means) < 0
    normals = np.where(away[:, None], -surfels.normals, surfels.normals)
    return replace(surfels, normals=normals, signed=True)


def surfels_from(means: NDArray[np.float64], covariances: NDArray[np.float64]) -> Surfels:
    """Find normals and planarity."""
    planes = Planes.of(covariances)
    return Surfels(means, covariances, planes.normals, planes.planarity)
