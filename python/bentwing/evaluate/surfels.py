# SPDX-License-Identifier: MIT OR Apache-2.0
"""Surfels of a reference: small discs of a terrestrial scan or of a mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.moments import Planes, VoxelMoments

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from bentwing.map.read_mesh import Mesh

_FEWEST = 6  # points in a surfel
_FLATTEST = 0.25  # thickness over the smaller width; thicker is an edge or a bush
_NARROWEST = 0.15  # of the voxel's edge: less spread sideways is a single scan line
_RADIUS = 0.6  # of the edge: discs that touch their neighbours
_MOST = 2_000_000  # surfels of a mesh


@dataclass(frozen=True, slots=True)
class Surfels:
    """Discs on a surface.

    Attributes
    ----------
    centres, normals : (K, 3) float64, m and unit vectors of any sign
    edge : m, distance between neighbouring centres
    """

    centres: NDArray[np.float64]
    normals: NDArray[np.float64]
    edge: float

    def __len__(self) -> int:
        return len(self.centres)

    @property
    def radius(self) -> float:
        """Of the discs, m."""
        return _RADIUS * self.edge


def surfels_of_cloud(parts: Iterable[NDArray[np.float64]], edge: float) -> Surfels:
    """Fit a disc to the points in every voxel in which they are flat.

    Parameters
    ----------
    parts : points (N, 3) m, a cloud of any size
    edge : m, of the voxels
    """
    voxels = VoxelMoments(edge)
    for points in parts:
        voxels.add(points)
    found = voxels.result()
    found = found[found.counts >= _FEWEST]
    planes = Planes.of(found.covariances)
    flat = (planes.thickness < _FLATTEST * planes.width) & (planes.width > _NARROWEST * edge)
    return Surfels(found.means[flat], planes.normals[flat], edge)


def surfels_of_mesh(mesh: Mesh, origin: NDArray[np.float64], edge: float) -> Surfels:
    """Lay discs on the triangles, at distances of at most `edge` or what memory allows.

    Parameters
    ----------
    mesh : triangles
    origin : (3,) m, subtracted from all coordinates
    edge : m
    """
    corners = mesh.vertices[mesh.triangles.astype(np.intp)] - origin
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    # the corner opposite to the longest side comes first: its two sides span the grid
    first = (np.argmax(sides, axis=1) + 2) % 3
    order = (first[:, None] + np.arange(3)) % 3
    corners = np.take_along_axis(corners, order[:, :, None], axis=1)
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    crossed = np.cross(a, b)
    areas = 0.5 * np.linalg.norm(crossed, axis=1)
    real = areas > 1e-9
    edge = max(edge, float(np.sqrt(areas.sum() / _MOST)))
    parts = [
        _on_triangles(c, u, v, edge)
        for c, u, v in _grouped(corners[real, 0], a[real], b[real], edge)
    ]
    centres = np.concatenate([centres for centres, _ in parts])
    normals = np.concatenate([normals for _, normals in parts])
    return Surfels(centres, normals, edge)


def _grouped(
    corner: NDArray[np.float64], a: NDArray[np.float64], b: NDArray[np.float64], edge: float
) -> Iterable[tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]]:
    """Triangles with grids of the same size together."""
    steps = [np.ceil(np.linalg.norm(side, axis=1) / edge).astype(np.int64) for side in (a, b)]
    pairs, group = np.unique(np.stack(steps, axis=1), axis=0, return_inverse=True)
    for i in range(len(pairs)):
        own = group.ravel() == i
        yield corner[own], a[own], b[own]


def _on_triangles(
    corner: NDArray[np.float64], a: NDArray[np.float64], b: NDArray[np.float64], edge: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centres and normals on triangles that share one grid."""
    n, m = (max(1, int(np.ceil(np.linalg.norm(side[0]) / edge))) for side in (a, b))
    u, v = (g.ravel() for g in np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(m) + 0.5) / m))
    inside = u + v <= 1 + 1e-9
    # a triangle smaller than a disc has one, in its middle
    u, v = (u[inside], v[inside]) if n * m > 1 else (np.full(1, 1 / 3), np.full(1, 1 / 3))
    centres = corner[:, None] + u[:, None] * a[:, None] + v[:, None] * b[:, None]
    normals = np.cross(a, b)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return centres.reshape(-1, 3), np.repeat(normals, len(u), axis=0)
