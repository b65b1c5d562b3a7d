# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where an instrument can stand on its tripod, and what it sees from there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.scenes import World

    Array = NDArray[np.float64]

TRIPOD = 1.6
"""m, of the instrument above the ground."""
_CLEARANCE = 0.8  # m around the instrument
_TRIED = 400


def standing_places(world: World, rng: np.random.Generator, n: int) -> Array:
    """Draw up to `n` places (K, 3) for an instrument within the site's box.

    Raises
    ------
    UsageError
        If there is none.
    """
    low, high = np.array(world.site.low), np.array(world.site.high)
    above = rng.uniform([*low[:2], high[2]], [*high[:2], high[2]], (_TRIED, 3))
    down = np.tile([0.0, 0.0, -1.0], (_TRIED, 1))
    ground = above[:, 2] - world.scene.cast(above, down, 200.0)[0]
    found = np.isfinite(ground) & (ground < world.site.pad_below)
    places = np.column_stack([above[found, :2], ground[found] + TRIPOD])
    places = np.ascontiguousarray(places[world.clearance(places) > _CLEARANCE])
    if not len(places):
        msg = "no place for a tripod was found in this scene: try another seed"
        raise UsageError(msg)
    return places[:n]


def sees(world: World, place: Array, targets: Array, slack: float) -> NDArray[np.bool_]:
    """Tell which targets (N, 3) are in line of sight of a place (3,), up to `slack` m before them."""
    ways = targets - place
    lengths = np.linalg.norm(ways, axis=1)
    directions = np.ascontiguousarray(ways / lengths[:, None])
    origins = np.tile(place, (len(targets), 1))
    hits, _ = world.scene.cast(origins, directions, float(lengths.max()) + 1.0)
    seen: NDArray[np.bool_] = hits > lengths - slack
    return seen
