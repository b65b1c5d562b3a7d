# SPDX-License-Identifier: MIT OR Apache-2.0
"""A building among others, lawns and trees, flown around in a loop (Fu 2023, section 3.4)."""

from __future__ import annotations

import numpy as np

from bentwing.simulate.scenes.mesh import Mesh, box, column, gable, ground, merge, smooth_noise
from bentwing.simulate.scenes.parts import car, facade, tree, windows
from bentwing.simulate.scenes.world import Site

DOOR = (3.0, 4.4, 0.0, 2.4)
LOOP = (62.0, 38.0)
"""m, sides of the loop: 200 m around."""
HEIGHT = 4.0


def campus(rng: np.random.Generator) -> Site:
    """Build about 110 × 85 m, open to one side; the loop leads around the middle building."""
    height = smooth_noise(rng, 30.0, 0.15)
    floor = ground((-55.0, 55.0), (-42.0, 42.0), 1.5, height)
    a, b = LOOP[0] / 2, LOOP[1] / 2
    parts = [floor, *_building((0.0, 0.0), (36.0, 16.0), rng.uniform(9.0, 12.0))]
    parts += _building((-10.0, 36.0), (44.0, 10.0), rng.uniform(7.0, 10.0))
    parts += _building((46.0, -4.0), (14.0, 40.0), rng.uniform(6.0, 9.0))
    parts += _trees(rng) + _cars(rng) + _small(rng)
    corners = ((-a, -b), (a, -b), (a, b), (-a, b))
    route = tuple((x, y, HEIGHT) for x, y in corners)
    low, high = (-a, -b, HEIGHT - 1.0), (a, b, HEIGHT + 1.0)
    return Site(merge(parts), low, high, pad_below=1.0, speed=1.7, route=route)


def _building(middle: tuple[float, float], size: tuple[float, float], height: float) -> list[Mesh]:
    """Four facades with windows and a flat roof."""
    length, width = size
    x, y = middle[0] - length / 2, middle[1] - width / 2
    sides = [
        ((x, y, -0.6), 0.0, length),
        ((x + length, y, -0.6), np.pi / 2, width),
        ((x + length, y + width, -0.6), np.pi, length),
        ((x, y + width, -0.6), -np.pi / 2, width),
    ]
    sills = np.arange(1.6, height - 1.8, 3.2).tolist()
    parts = []
    for at, yaw, extent in sides:
        openings = [o for o in windows(extent, sills, 2.8) if o[0] > DOOR[1] + 0.2]
        parts.append(facade(extent, height, [DOOR, *openings], 0.2).moved(at, yaw))
    roof = box((x, y, height - 0.9), (x + length, y + width, height - 0.6))
    return [*parts, roof]


def _trees(rng: np.random.Generator) -> list[Mesh]:
    """Rows along the paths, on the side away from the building."""
    xs = np.arange(-46.0, 34.0, 8.0)
    places = (
        [(x, -26.5) for x in xs] + [(x, 25.8) for x in xs[::2]] + [(-40.0, y) for y in (-12, 0, 12)]
    )
    return [
        tree(rng, rng.uniform(5.0, 8.0)).moved(
            (x + rng.uniform(-1, 1), y + rng.uniform(-0.8, 0.8), -0.2)
        )
        for x, y in places
    ]


def _cars(rng: np.random.Generator) -> list[Mesh]:
    return [
        car().moved((x + rng.uniform(-0.3, 0.3), -33.0, 0.0), np.pi / 2 + rng.normal(0.0, 0.04))
        for x in np.arange(-40.0, 30.0, 2.8)
        if rng.random() < 0.6
    ]


def _small(rng: np.random.Generator) -> list[Mesh]:
    """Lamp posts, benches and a bicycle shed."""
    parts = [
        column((0.08, 0.05), 4.5, 8).moved((x, -24.2, -0.2)) for x in (-36.0, -12.0, 12.0, 30.0)
    ]
    parts += [
        box((0, 0, 0), (1.8, 0.5, 0.8)).moved((x, 13.0, -0.1), rng.uniform(-0.2, 0.2))
        for x in (-14.0, 0.0, 10.0)
    ]
    parts.append(gable((0, 0, -0.2), (7.0, 3.0, 2.3), 0.8, 0.3).moved((-48.0, 20.0, 0.0)))
    return parts
