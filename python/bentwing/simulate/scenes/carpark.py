# SPDX-License-Identifier: MIT OR Apache-2.0
"""An underground car park, flown along a lane and back (Fu 2023, section 3.3.2)."""

from __future__ import annotations

import numpy as np

from bentwing.simulate.scenes.mesh import Mesh, box, merge, quad
from bentwing.simulate.scenes.parts import car, facade
from bentwing.simulate.scenes.world import Site

LANE, BAY = 6.5, (5.2, 2.6)
"""m, width of a lane; depth and width of a bay."""
PILLARS = 7.8
"""m, from one to the next: three bays."""


def carpark(rng: np.random.Generator, things: np.random.Generator | None = None) -> Site:
    """Build six fields of three bays on both sides of a lane and a third row behind, about 47 × 22 m.

    `things` draws the cars; by default `rng` does.
    """
    length, height = 6 * PILLARS, rng.uniform(2.8, 3.1)
    width = 3 * BAY[0] + LANE
    floor = quad([(0, 0, 0), (length, 0, 0), (length, width, 0), (0, width, 0)])
    ceiling = quad([(0, width, height), (length, width, height), (length, 0, height), (0, 0, height)])  # fmt: skip
    parts = [floor, ceiling, *_walls(length, width, height), *_structure(length, width, height)]
    lane = BAY[0] + LANE / 2
    parts += _cars(things or rng, length)
    parts += [_pipe(length, y, height) for y in (1.2, width - 2.0)]
    route = ((5.0, lane, 1.35), (length - 5.0, lane, 1.35))
    low, high = (2.0, BAY[0] + 1.2, 1.1), (length - 2.0, BAY[0] + LANE - 1.2, 1.6)
    return Site(merge(parts), low, high, pad_below=0.1, speed=1.0, route=route)


def _walls(length: float, width: float, height: float) -> list[Mesh]:
    doors = [(3.0, 4.0, 0.0, 2.1), (30.0, 31.0, 0.0, 2.1)]
    gate = [(BAY[0] + 0.5, BAY[0] + LANE - 0.5, 0.0, 2.5)]
    return [
        facade(length, height, doors, 0.3).moved((length, 0, 0), np.pi),
        facade(length, height, doors[:1], 0.3).moved((0, width, 0)),
        facade(width, height, [], 0.1).moved((length, width, 0), -np.pi / 2),
        facade(width, height, gate, 0.4).moved((0, 0, 0), np.pi / 2),
    ]


def _structure(length: float, width: float, height: float) -> list[Mesh]:
    """Pillars between the bays, and a beam over each row of them."""
    parts = []
    for x in np.arange(PILLARS, length - 1.0, PILLARS):
        parts.append(box((x - 0.15, 0.0, height - 0.35), (x + 0.15, width, height)))
        parts += [
            box((x - 0.2, y - 0.2, 0.0), (x + 0.2, y + 0.2, height))
            for y in (BAY[0] - 0.4, BAY[0] + LANE + 0.4)
        ]
    return parts


def _pipe(length: float, y: float, height: float) -> Mesh:
    return box((0.5, y - 0.1, height - 0.6), (length - 0.5, y + 0.1, height - 0.4))


def _cars(rng: np.random.Generator, length: float) -> list[Mesh]:
    """Fill two bays of three, in three rows."""
    rows = (
        (2.4, np.pi / 2),
        (BAY[0] + LANE + 2.8, -np.pi / 2),
        (2 * BAY[0] + LANE + 2.6, np.pi / 2),
    )
    parts = []
    for y, heading in rows:
        for x in np.arange(BAY[1] / 2, length, BAY[1]):
            if rng.random() < 0.67:
                at = (x + rng.uniform(-0.15, 0.15), y + rng.uniform(-0.2, 0.2), 0.0)
                parts.append(car().moved(at, heading + rng.normal(0.0, 0.03)))
    return parts
