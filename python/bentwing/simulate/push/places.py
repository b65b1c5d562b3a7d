# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where the runs take place: free starts in the simulator's scenes, and a narrow door."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.simulate.scenes import SCENES, Site, World
from bentwing.simulate.scenes.mesh import box, merge, quad

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.push.quadrotor import QuadrotorSettings

    Array = NDArray[np.float64]

_AROUND = 2 * np.pi * np.arange(48) / 48
_CANDIDATES = 4000


def door_site(rng: np.random.Generator) -> Site:
    """Two rooms of 6 × 5 m behind each other, with a door of 1.5 to 2.5 m in the wall between."""
    width, middle = rng.uniform(1.5, 2.5), rng.uniform(2.0, 3.0)
    left, right = middle - width / 2, middle + width / 2
    parts = [
        quad([(0, 0, 0), (12, 0, 0), (12, 5, 0), (0, 5, 0)]),
        *(box((x, -0.2, 0), (x + 0.2, 5.2, 3)) for x in (-0.2, 12.0)),
        *(box((-0.2, y, 0), (12.2, y + 0.2, 3)) for y in (-0.2, 5.0)),
        box((5.9, 0, 0), (6.1, left, 3)),
        box((5.9, right, 0), (6.1, 5, 3)),
    ]
    return Site(merge(parts), (1.5, 1.5, 1.2), (4.0, 3.5, 1.6), pad_below=0.1, speed=1.0)


PLACES = {**{name: SCENES[name] for name in ("office", "cave", "forest")}, "door": door_site}


def free_start(world: World, rng: np.random.Generator, margin: float) -> Array:
    """Return a place (3,) in the site's box that is `margin` m away from every surface.

    Raises
    ------
    UsageError
        If there is none.
    """
    low, high = world.site.low, world.site.high
    places = rng.uniform(low, high, size=(_CANDIDATES, 3))
    free = places[world.clearance(places) > margin]
    if not len(free):
        msg = f"no place in this scene is {margin:g} m away from every surface: try another seed"
        raise UsageError(msg)
    return np.array(free[0])


def hull_clearance(world: World, settings: QuadrotorSettings, position: Array) -> float:
    """Return the gap between the hull, a flat cylinder, and what is beside it, m; below 0 is contact."""
    heights = np.array([-settings.below, -0.5 * settings.below, 0.0, settings.above])
    across = np.column_stack([np.cos(_AROUND), np.sin(_AROUND), np.zeros(len(_AROUND))])
    origins = position + np.repeat(heights, len(across))[:, None] * [0.0, 0.0, 1.0]
    directions = np.tile(across, (len(heights), 1))
    ranges, _ = world.scene.cast(np.ascontiguousarray(origins), directions, 10.0)
    return float(ranges.min()) - settings.hull_radius
