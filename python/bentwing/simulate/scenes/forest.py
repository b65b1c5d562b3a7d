# SPDX-License-Identifier: MIT OR Apache-2.0
"""Trunks, foliage and undergrowth on uneven ground: hardly a plane anywhere."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.scenes.mesh import FOLIAGE, Mesh, column, ground, merge, smooth_noise
from bentwing.simulate.scenes.world import Site

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.scenes.mesh import Field

    Array = NDArray[np.float64]

SEPARATION = 2.6
"""m, between trunks."""


def forest(rng: np.random.Generator) -> Site:
    """Plant about 70 trees on 36 × 28 m."""
    length, width = rng.uniform(33.0, 38.0), rng.uniform(26.0, 30.0)
    hills, bumps = smooth_noise(rng, 14.0, 0.35), smooth_noise(rng, 2.0, 0.05)

    def height(xy: Array) -> Array:
        return hills(xy) + bumps(xy)

    floor = ground((-8.0, length + 8.0), (-8.0, width + 8.0), 0.4, height)
    trees = [
        _tree(rng).moved((*at, z - 0.2), rng.uniform(0, 2 * np.pi))
        for at, z in _stand(rng, length, width, height)
    ]
    bushes = rng.uniform((0.0, 0.0), (length, width), size=(25, 2))
    shrubs = [
        leaves(rng, 60, (0.5, 0.5, 0.35), 0.07).moved((*at, z + 0.3))
        for at, z in zip(bushes, height(bushes), strict=True)
    ]
    low, high = (3.0, 3.0, 1.7), (length - 3.0, width - 3.0, 3.8)
    return Site(merge([floor, *trees, *shrubs]), low, high, pad_below=1.2, speed=0.9)


def _stand(
    rng: np.random.Generator, length: float, width: float, height: Field
) -> list[tuple[Array, float]]:
    """Positions of trees, none too close to another, with the ground's height."""
    chosen: list[Array] = []
    for at in rng.uniform((-4.0, -4.0), (length + 4.0, width + 4.0), size=(900, 2)):
        if all(np.linalg.norm(at - other) > SEPARATION for other in chosen):
            chosen.append(at)
        if len(chosen) == 95:
            break
    return list(zip(chosen, height(np.array(chosen)).tolist(), strict=True))


def _tree(rng: np.random.Generator) -> Mesh:
    """Grow a leaning trunk with a few branches' worth of leaves."""
    tall, radius = rng.uniform(7.0, 12.0), rng.uniform(0.11, 0.26)
    trunk = column((radius, 0.35 * radius), tall, 10)
    lean = rng.uniform(0.0, 0.06)
    trunk = Mesh(trunk.vertices + trunk.vertices[:, 2:] * [lean, 0.0, 0.0], trunk.triangles)
    clumps = []
    for _ in range(5):
        at = (*rng.normal(0.0, 0.9, 2), tall * rng.uniform(0.55, 1.0))
        clumps.append(leaves(rng, 50, (0.8, 0.8, 0.6), 0.1).moved(at))
    return merge([trunk, *clumps])


def leaves(rng: np.random.Generator, n: int, spread: tuple[float, ...], size: float) -> Mesh:
    """Scatter `n` triangles of about `size` m around the origin."""
    centres = rng.normal(0.0, 1.0, (n, 1, 3)) * spread
    corners = centres + rng.normal(0.0, size, (n, 3, 3))
    triangles = np.arange(3 * n, dtype=np.uint32).reshape(-1, 3)
    return Mesh(corners.reshape(-1, 3), triangles).made_of(FOLIAGE)
