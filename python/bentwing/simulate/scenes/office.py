# SPDX-License-Identifier: MIT OR Apache-2.0
"""An open-plan office with partitions, a meeting room, furniture and a ceiling with lamps."""

from __future__ import annotations

import numpy as np

from bentwing.simulate.scenes.mesh import Mesh, box, merge, quad
from bentwing.simulate.scenes.parts import facade, shelf, table, windows
from bentwing.simulate.scenes.world import Site

WALL = 0.12
DOOR = (0.4, 1.3, 0.0, 2.05)


def office(rng: np.random.Generator, things: np.random.Generator | None = None) -> Site:
    """About 15 × 10 m, 2.8 to 3.2 m high; `things` draws its furniture, by default `rng` does."""
    length, width = rng.uniform(14.0, 16.0), rng.uniform(9.5, 10.5)
    height = rng.uniform(2.85, 3.2)
    parts = [
        quad([(0, 0, 0), (length, 0, 0), (length, width, 0), (0, width, 0)]),
        quad([(0, width, height), (length, width, height), (length, 0, height), (0, 0, height)]),
        *_outer_walls(length, width, height),
        *_partitions(rng, length, width, height),
        *_furniture(things or rng, length, width, height),
    ]
    return Site(
        merge(parts), (0.9, 0.9, 0.95), (length - 0.9, width - 0.9, 2.1), pad_below=0.1, speed=0.8
    )


def _outer_walls(length: float, width: float, height: float) -> list[Mesh]:
    openings = windows(length, (0.9,), 2.1)
    return [
        facade(length, height, openings, 0.22).moved((length, 0, 0), np.pi),
        facade(length, height, [DOOR, *openings[1:]], 0.15).moved((0, width, 0)),
        facade(width, height, [DOOR], 0.1).moved((length, width, 0), -np.pi / 2),
        facade(width, height, windows(width, (0.9,), 2.4), 0.22).moved((0, 0, 0), np.pi / 2),
    ]


def _partitions(rng: np.random.Generator, length: float, width: float, height: float) -> list[Mesh]:
    """Two cross walls with wide passages, and a meeting room with an open door in a corner."""
    parts = []
    for share in (0.34, 0.68):
        x, gap = share * length + rng.uniform(-0.4, 0.4), rng.uniform(2.9, 3.4)
        middle = 0.5 * width + rng.uniform(-0.3, 0.3)
        parts.append(box((x, 0, 0), (x + WALL, middle - gap / 2, height)))
        parts.append(box((x, middle + gap / 2, 0), (x + WALL, width, height)))
    room_x, room_y = length - 3.2, 2.9
    parts += [
        box((room_x, room_y, 0), (room_x + 0.6, room_y + WALL, height)),
        box((room_x + 1.5, room_y, 0), (length, room_y + WALL, height)),
        box((room_x + 0.6, room_y, 2.05), (room_x + 1.5, room_y + WALL, height)),
        box((room_x - WALL, 0, 0), (room_x, room_y + WALL, height)),
    ]
    return parts


def _furniture(rng: np.random.Generator, length: float, width: float, height: float) -> list[Mesh]:
    parts = []
    for x, y in ((0.15, 0.12), (0.15, 0.88), (0.5, 0.1), (0.52, 0.9), (0.86, 0.88)):
        at = (x * length + rng.uniform(-0.3, 0.3), y * width, 0.0)
        desk = [table(1.6, 0.8), box((-0.3, -0.05, 0.74), (0.3, 0.02, 1.1))]
        parts.append(merge(desk).moved(at, rng.uniform(-0.1, 0.1)))
    parts.append(table(1.8, 1.0).moved((length - 1.6, 1.4, 0.0)))
    parts += [
        shelf(1.2, 1.9).moved((x * length + 0.4, width - 0.02, 0.0)) for x in (0.05, 0.4, 0.75)
    ]
    for x, y in ((0.25, 0.3), (0.59, 0.7)):
        pillar = box((-0.2, -0.2, 0), (0.2, 0.2, height))
        parts.append(pillar.moved((x * length, y * width + rng.uniform(-0.3, 0.3), 0.0)))
    lamp = box((-0.6, -0.15, height - 0.08), (0.6, 0.15, height))
    parts += [
        lamp.moved((x, y, 0.0))
        for x in np.arange(1.5, length - 1.0, 2.4)
        for y in (0.3 * width, 0.7 * width)
    ]
    return parts
