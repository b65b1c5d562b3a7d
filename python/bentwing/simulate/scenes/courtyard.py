# SPDX-License-Identifier: MIT OR Apache-2.0
"""A yard between four facades, with a shed, trees and cars on slightly uneven ground."""

from __future__ import annotations

import numpy as np

from bentwing.simulate.scenes.mesh import Mesh, box, gable, ground, merge, smooth_noise
from bentwing.simulate.scenes.parts import car, facade, tree, windows
from bentwing.simulate.scenes.world import Site

DOOR = (2.0, 3.1, 0.0, 2.2)


def courtyard(rng: np.random.Generator, things: np.random.Generator | None = None) -> Site:
    """Open above; about 30 × 20 m, walls 6 to 9 m high.

    `things` draws what stands in it; by default `rng` does.
    """
    length, width = rng.uniform(28.0, 32.0), rng.uniform(18.0, 21.0)
    height = smooth_noise(rng, 6.0, 0.035)
    floor = ground((-2.0, length + 2.0), (-2.0, width + 2.0), 0.5, height)
    walls = facades(rng, (length, width), (6.0, 9.0), (1.1, 4.0))
    mesh = merge([floor, *walls, *_things(things or rng, length, width)])
    return Site(mesh, (2.0, 2.0, 1.5), (length - 2.0, width - 2.0, 5.0), pad_below=0.2, speed=1.2)


def facades(
    rng: np.random.Generator,
    size: tuple[float, float],
    heights: tuple[float, float],
    sills: tuple[float, ...],
) -> list[Mesh]:
    """Close a yard of `size` m by four facades of any of `heights`, with a door and windows each."""
    length, width = size
    sides = [
        ((length, 0.0, -0.2), np.pi, length),
        ((length, width, -0.2), -np.pi / 2, width),
        ((0.0, width, -0.2), 0.0, length),
        ((0.0, 0.0, -0.2), np.pi / 2, width),
    ]
    parts = []
    for at, yaw, extent in sides:
        openings = [o for o in windows(extent, sills, rng.uniform(2.4, 3.4)) if o[0] > DOOR[1]]
        wall = facade(extent, rng.uniform(*heights), [DOOR, *openings], rng.uniform(0.12, 0.25))
        parts.append(wall.moved(at, yaw))
    return parts


def _things(rng: np.random.Generator, length: float, width: float) -> list[Mesh]:
    shed = gable((0.0, 0.0, -0.2), (3.6, 2.6, 2.2), 1.0, 0.25)
    parts = [shed.moved((length - 5.5, width - 4.5, 0.0), rng.uniform(-0.2, 0.2))]
    for x, y in ((0.25, 0.3), (0.55, 0.72), (0.8, 0.25)):
        at = (x * length + rng.uniform(-1, 1), y * width + rng.uniform(-1, 1), -0.1)
        parts.append(tree(rng, rng.uniform(4.5, 6.5)).moved(at))
    for x in (0.15, 0.42):
        at = (x * length + rng.uniform(-0.5, 0.5), 0.82 * width, 0.0)
        parts.append(car().moved(at, np.pi / 2 + rng.uniform(-0.1, 0.1)))
    crates = rng.uniform(0.5, 1.1, size=(4, 3))
    for size in crates:
        at = (rng.uniform(0.3, 0.7) * length, rng.uniform(0.3, 0.6) * width, -0.1)
        parts.append(box((0, 0, 0), size).moved(at, rng.uniform(0, np.pi)))
    return parts
