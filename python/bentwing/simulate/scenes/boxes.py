# SPDX-License-Identifier: MIT OR Apache-2.0
"""Boxes that stand on the free ground of a scene, elsewhere in every flight."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.simulate.scenes.mesh import box, merge
from bentwing.simulate.scenes.world import Site, World

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_SMALLEST, _LARGEST = (0.5, 0.4, 0.5), (1.3, 0.9, 1.7)
"""m, from a crate to a cupboard."""
_TRIES = 4000
_GAP = 0.1
"""m, at least, to what stands beside a box."""
_BESIDE_ROUTE = 1.2
"""m, at least, from a way that every flight of the scene takes."""
_SUNK = 0.1
"""m; ground is not level."""


def with_boxes(site: Site, n: int, sizes: np.random.Generator, spots: np.random.Generator) -> Site:
    """Stand `n` boxes on the free ground of a site.

    Parameters
    ----------
    sizes : draws how large they are
    spots : draws where they stand

    Raises
    ------
    UsageError
        If there is no room for them.
    """
    for size in sizes.uniform(_SMALLEST, _LARGEST, (n, 3)):
        spot = free_spot(site, size, spots)
        if spot is None:
            msg = f"no room for {n} boxes in this scene: ask for fewer, or try another seed"
            raise UsageError(msg)
        a, b, c = size
        body = box((-a / 2, -b / 2, -_SUNK), (a / 2, b / 2, c))
        site = replace(site, mesh=merge([site.mesh, body.moved(*spot)]))
    return site


def free_spot(
    site: Site, size: Array, rng: np.random.Generator
) -> tuple[tuple[float, float, float], float] | None:
    """Return place and yaw on the ground where there is room for a box; None if none was found."""
    world, radius = World(site), float(np.hypot(*size[:2])) / 2
    xy = rng.uniform(site.low[:2], site.high[:2], (_TRIES, 2))
    yaws = rng.uniform(0.0, np.pi, _TRIES)
    # from above all furniture, so that nothing is stood under a table or inside a shed
    above = np.column_stack([xy, np.full(_TRIES, site.high[2])])
    down = np.tile([0.0, 0.0, -1.0], (_TRIES, 1))
    heights = site.high[2] - world.scene.cast(above, down, 200.0)[0]
    # in rock there is no ground
    free = np.isfinite(heights) & (heights < site.pad_below)
    free &= _from_route(site, xy) > _BESIDE_ROUTE + radius
    for height in np.linspace(0.3, size[2], 5):
        at = np.column_stack([xy, heights + height])
        # near the ground the ground itself is the nearest surface
        free[free] = world.clearance(at[free]) > min(radius + _GAP, 0.7 * height)
    chosen = np.flatnonzero(free)
    if not len(chosen):
        return None
    k = chosen[0]
    return (float(xy[k, 0]), float(xy[k, 1]), float(heights[k])), float(yaws[k])


def _from_route(site: Site, xy: Array) -> Array:
    """Distances (N,) of points (N, 2) from the way that every flight takes, m."""
    nearest = np.full(len(xy), np.inf)
    corners = np.array([(x, y) for x, y, _ in site.route]).reshape(-1, 2)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        leg = end - start
        along = np.clip((xy - start) @ leg / (leg @ leg), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(xy - start - along[:, None] * leg, axis=1))
    return nearest
