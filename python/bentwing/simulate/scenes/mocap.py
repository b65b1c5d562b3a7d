# SPDX-License-Identifier: MIT OR Apache-2.0
"""A room with cameras for motion capture, flown around in a rectangle (Fu 2023, section 3.3.1)."""

from __future__ import annotations

import numpy as np

from bentwing.simulate.scenes.mesh import Mesh, box, column, merge, quad
from bentwing.simulate.scenes.parts import facade, shelf, table, windows
from bentwing.simulate.scenes.world import Site

DOOR = (0.6, 1.6, 0.0, 2.1)
HEIGHT = 1.3
"""m, of the flight above the floor."""


def mocap(rng: np.random.Generator) -> Site:
    """About 10 × 8 m and 4 m high; the rectangle is 4 to 5 m by 2.5 to 3.5 m."""
    length, width, height = rng.uniform((9.5, 7.5, 3.8), (10.5, 8.5, 4.4))
    floor = quad([(0, 0, 0), (length, 0, 0), (length, width, 0), (0, width, 0)])
    ceiling = quad([(0, width, height), (length, width, height), (length, 0, height), (0, 0, height)])  # fmt: skip
    parts = [floor, ceiling, *_walls(length, width, height), *_truss(length, width, height)]
    parts += _furniture(rng, length, width)
    half = rng.uniform((2.0, 1.25), (2.5, 1.75))
    middle = np.array([length, width]) / 2
    corners = [middle + half * np.array(sign) for sign in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    route = tuple((float(x), float(y), HEIGHT) for x, y in corners)
    low, high = (1.2, 1.2, 1.0), (length - 1.2, width - 1.2, 1.9)
    return Site(merge(parts), low, high, pad_below=0.1, speed=0.6, route=route)


def _walls(length: float, width: float, height: float) -> list[Mesh]:
    return [
        facade(length, height, windows(length, (1.0,), 2.6), 0.2).moved((length, 0, 0), np.pi),
        facade(length, height, [DOOR], 0.1).moved((0, width, 0)),
        facade(width, height, [], 0.1).moved((length, width, 0), -np.pi / 2),
        facade(width, height, [DOOR], 0.1).moved((0, 0, 0), np.pi / 2),
    ]


def _truss(length: float, width: float, height: float) -> list[Mesh]:
    """Bars all around below the ceiling, with eight cameras on them."""
    z, d = height - 0.7, 0.35
    bars = [box((d, y - 0.03, z), (length - d, y + 0.03, z + 0.06)) for y in (d, width - d)] + [
        box((x - 0.03, d, z), (x + 0.03, width - d, z + 0.06)) for x in (d, length - d)
    ]
    cameras = [
        box((x - 0.06, y - 0.06, z - 0.16), (x + 0.06, y + 0.06, z))
        for x in (d, length / 2, length - d)
        for y in (d, width / 2, width - d)
        if (x, y) != (length / 2, width / 2)
    ]
    return [*bars, *cameras]


def _furniture(rng: np.random.Generator, length: float, width: float) -> list[Mesh]:
    """Build what stands at the walls: desks with screens, a shelf, cupboards, tripods."""
    desk = merge([table(1.6, 0.8), box((-0.3, -0.05, 0.74), (0.3, 0.02, 1.15))])
    parts = [
        desk.moved((x + rng.uniform(-0.2, 0.2), 0.55, 0.0), rng.uniform(-0.05, 0.05))
        for x in (0.3 * length, 0.3 * length + 2.0)
    ]
    parts.append(shelf(1.6, 2.0).moved((0.55 * length, width - 0.02, 0.0)))
    parts.append(box((length - 0.5, 0.3 * width, 0.0), (length - 0.02, 0.3 * width + 1.2, 1.9)))
    for x, y in ((0.1, 0.85), (0.92, 0.9)):
        tripod = merge([column((0.25, 0.03), 1.4, 5), box((-0.08, -0.08, 1.4), (0.08, 0.08, 1.6))])
        parts.append(tripod.moved((x * length, y * width, 0.0), rng.uniform(0.0, 3.0)))
    return parts
