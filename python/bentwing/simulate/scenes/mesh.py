# SPDX-License-Identifier: MIT OR Apache-2.0
"""Triangle meshes of simple bodies; corners turn counter-clockwise seen from free space."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]
    Field = Callable[[Array], Array]


SOLID, GLASS, FOLIAGE = range(3)


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles.

    Attributes
    ----------
    vertices : (V, 3) float64, m
    triangles : (T, 3) uint32, indices into `vertices`
    materials : (T,) uint8, `SOLID`, `GLASS` or `FOLIAGE`; None where all are solid
    """

    vertices: Array
    triangles: NDArray[np.uint32]
    materials: NDArray[np.uint8] | None = None

    def moved(self, at: ArrayLike, yaw: float = 0.0) -> Mesh:
        """Return the mesh turned about the vertical axis through the origin, then shifted by `at`."""
        c, s = np.cos(yaw), np.sin(yaw)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return Mesh(self.vertices @ turn.T + np.asarray(at), self.triangles, self.materials)

    def made_of(self, material: int) -> Mesh:
        """Return the mesh, all of one material."""
        return replace(self, materials=np.full(len(self.triangles), material, dtype=np.uint8))

    def of(self, material: int) -> NDArray[np.bool_]:
        """Tell which triangles (T,) are of the material."""
        if self.materials is None:
            return np.full(len(self.triangles), material == SOLID)
        return np.asarray(self.materials == material)

    def only(self, chosen: NDArray[np.bool_]) -> Mesh:
        """Return some of the triangles."""
        kinds = None if self.materials is None else self.materials[chosen]
        return Mesh(self.vertices, np.ascontiguousarray(self.triangles[chosen]), kinds)


def merge(meshes: Iterable[Mesh]) -> Mesh:
    """All meshes as one."""
    parts = list(meshes)
    offsets = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    triangles = [part.triangles + np.uint32(o) for part, o in zip(parts, offsets, strict=True)]
    vertices = np.ascontiguousarray(np.vstack([part.vertices for part in parts]))
    if all(part.materials is None for part in parts):
        return Mesh(vertices, np.vstack(triangles))
    none = [np.full(len(part.triangles), SOLID, dtype=np.uint8) for part in parts]
    kinds = [n if p.materials is None else p.materials for n, p in zip(none, parts, strict=True)]
    return Mesh(vertices, np.vstack(triangles), np.concatenate(kinds))


def box(low: ArrayLike, high: ArrayLike) -> Mesh:
    """Build an axis-aligned box seen from outside."""
    corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")).reshape(3, 8).T
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    return Mesh(low + corners * (high - low), np.array(triangles, dtype=np.uint32))


def quad(corners: ArrayLike) -> Mesh:
    """Build a flat four-cornered face, corners counter-clockwise."""
    triangles = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)
    return Mesh(np.asarray(corners, dtype=np.float64), triangles)


def sheet(points: Array) -> Mesh:
    """Build a surface through a grid of points (A, B, 3), facing `∂/∂A × ∂/∂B`."""
    n_a, n_b = points.shape[:2]
    index = np.arange(n_a * n_b, dtype=np.uint32).reshape(n_a, n_b)
    p, q, r, s = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.stack([np.stack([p, q, r], -1), np.stack([p, r, s], -1)], axis=2)
    return Mesh(points.reshape(-1, 3), np.ascontiguousarray(triangles.reshape(-1, 3)))


def ground(x: tuple[float, float], y: tuple[float, float], step: float, height: Field) -> Mesh:
    """Build a height field over a rectangle; `height` maps (N, 2) to (N,)."""
    nx, ny = (int(np.ceil((b - a) / step)) + 1 for a, b in (x, y))
    xy = np.stack(np.meshgrid(np.linspace(*x, nx), np.linspace(*y, ny), indexing="ij"), axis=-1)
    z = height(xy.reshape(-1, 2)).reshape(nx, ny, 1)
    return sheet(np.concatenate([xy, z], axis=-1))


def column(radius: tuple[float, float], height: float, sides: int) -> Mesh:
    """Build a standing prism or truncated cone (radius below and above), closed above."""
    angles = np.linspace(0.0, 2 * np.pi, sides + 1)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    below = np.column_stack([radius[0] * ring, np.zeros(sides + 1)])
    above = np.column_stack([radius[1] * ring, np.full(sides + 1, height)])
    centre = np.tile([0.0, 0.0, height], (sides + 1, 1))
    return sheet(np.stack([below, above, centre], axis=1))


def ball(radius: ArrayLike, n: int, field: Field | None = None) -> Mesh:
    """Build an ellipsoid of about 2 n² faces, its radius scaled by `1 + field(unit vectors)`."""
    polar, azimuth = np.linspace(np.pi, 0.0, n + 1), np.linspace(0.0, 2 * np.pi, 2 * n + 1)
    p, a = np.meshgrid(polar, azimuth, indexing="ij")
    unit = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1)
    unit[:, -1] = unit[:, 0]
    scale = 1.0 + (field(unit.reshape(-1, 3)).reshape(*p.shape, 1) if field else 0.0)
    return sheet(np.swapaxes(unit * scale * np.asarray(radius), 0, 1))


def gable(low: ArrayLike, high: ArrayLike, rise: float, overhang: float) -> Mesh:
    """Build a house: a box whose roof ridge runs along x, `rise` above the eaves."""
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    (x0, y0, z0), (x1, y1, z1) = low, high
    ym, zr = (y0 + y1) / 2, z1 + rise
    drop = overhang * rise / (ym - y0)
    a, b, e = x0 - overhang, x1 + overhang, y0 - overhang
    f = y1 + overhang
    walls = [
        quad([(x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)]),
        quad([(x1, y1, z0), (x0, y1, z0), (x0, y1, z1), (x1, y1, z1)]),
        quad([(x1, y0, z0), (x1, y1, z0), (x1, y1, z1), (x1, y0, z1)]),
        quad([(x0, y1, z0), (x0, y0, z0), (x0, y0, z1), (x0, y1, z1)]),
    ]
    ends = [
        Mesh(np.array([(x1, y0, z1), (x1, y1, z1), (x1, ym, zr)]), _ONE_TRIANGLE),
        Mesh(np.array([(x0, y1, z1), (x0, y0, z1), (x0, ym, zr)]), _ONE_TRIANGLE),
    ]
    roof = [
        quad([(a, e, z1 - drop), (b, e, z1 - drop), (b, ym, zr), (a, ym, zr)]),
        quad([(b, f, z1 - drop), (a, f, z1 - drop), (a, ym, zr), (b, ym, zr)]),
    ]
    return merge([*walls, *ends, *roof])


_ONE_TRIANGLE = np.array([[0, 1, 2]], dtype=np.uint32)


def smooth_noise(
    rng: np.random.Generator, wavelength: float, amplitude: float, dimensions: int = 2
) -> Field:
    """Draw a random smooth function of position with the given wavelength (m) and standard deviation."""
    n_waves = 24
    waves = rng.normal(size=(n_waves, dimensions)) / wavelength * 2 * np.pi / np.sqrt(dimensions)
    phases = rng.uniform(0.0, 2 * np.pi, n_waves)

    def field(points: Array) -> Array:
        values: Array = np.cos(points @ waves.T + phases).sum(axis=1)
        scaled: Array = values * (amplitude * np.sqrt(2 / n_waves))
        return scaled

    return field
