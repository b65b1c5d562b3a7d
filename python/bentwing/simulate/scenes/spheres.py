# SPDX-License-Identifier: MIT OR Apache-2.0
"""Spheres on posts that a surveyor has stood up in a scene, as marks that a lidar can see."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.simulate.scenes.boxes import free_spot
from bentwing.simulate.scenes.mesh import ball, column, merge

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.simulate.scenes.world import Site

RADIUS = 0.1
"""m."""
_HEIGHTS = (0.9, 1.5)
"""m, of their centres above the ground."""
_POST = 0.012
"""m, radius."""
_ROOM = 0.5
"""m, across, that nothing else stands in."""
_SIDES = 24


def with_spheres(site: Site, n: int, rng: np.random.Generator) -> Site:
    """Stand `n` spheres on the free ground of a site.

    Raises
    ------
    UsageError
        If there is no room for them.
    """
    for height in rng.uniform(*_HEIGHTS, n):
        spot = free_spot(site, np.array([_ROOM, _ROOM, height + _ROOM / 2]), rng)
        if spot is None:
            msg = f"no room for {n} spheres in this scene: ask for fewer, or try another seed"
            raise UsageError(msg)
        (x, y, z), _ = spot
        centre = x, y, z + float(height)
        post = column((_POST, _POST), height - RADIUS, 6).moved((x, y, z))
        mesh = merge([site.mesh, post, ball(RADIUS, _SIDES).moved(centre)])
        site = replace(site, mesh=mesh, spheres=(*site.spheres, centre))
    return site


def control_points(centres: Sequence[tuple[float, float, float]]) -> str:
    """Return spheres as a file of control points, in the frame of the scene."""
    rows = [
        f"S{k},{x:.4f},{y:.4f},{z:.4f},{RADIUS},sphere\n" for k, (x, y, z) in enumerate(centres, 1)
    ]
    return "id,x,y,z,radius,kind\n" + "".join(rows)
