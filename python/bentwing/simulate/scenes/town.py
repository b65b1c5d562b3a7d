# SPDX-License-Identifier: MIT OR Apache-2.0
"""Houses with gabled roofs along streets, to be seen from 30 m above."""

from __future__ import annotations

import numpy as np

from bentwing.simulate.scenes.mesh import Mesh, box, gable, ground, merge, smooth_noise
from bentwing.simulate.scenes.parts import car, tree
from bentwing.simulate.scenes.world import Site, Survey

BLOCK = (24.0, 22.0)
"""m, from one street to the next."""


def town(rng: np.random.Generator) -> Site:
    """Build 6 × 5 plots, about 145 × 110 m."""
    height = smooth_noise(rng, 40.0, 0.25)
    length, width = 6 * BLOCK[0], 5 * BLOCK[1]
    floor = ground((-25.0, length + 25.0), (-25.0, width + 25.0), 2.5, height)
    parts = [floor]
    for i in range(6):
        for j in range(5):
            corner = np.array([i * BLOCK[0], j * BLOCK[1]])
            z = float(height(corner[None] + 10.0)[0])
            parts += [part.moved((*corner, z)) for part in _plot(rng)]
    low, high = (15.0, 15.0, 25.0), (length - 15.0, width - 15.0, 33.0)
    # Tazir 2020, experiment 1: 100 m at 30 m above the ground and 1 m/s.
    survey = Survey(((30.0, 30.0, 30.0), (80.0, 30.0, 30.0), (80.0, 80.0, 30.0)), speed=1.0)
    return Site(merge(parts), low, high, pad_below=1.5, speed=2.0, survey=survey)


def _plot(rng: np.random.Generator) -> list[Mesh]:
    """Build a house, mostly with an annex, a tree and a car, on a plot with its corner at the origin."""
    size = rng.uniform((9.0, 7.5, 3.0), (14.0, 10.0, 7.5))
    turn = rng.choice([0.0, np.pi / 2]) + rng.normal(0.0, 0.04)
    middle = (11.0 + rng.uniform(-1, 1), 10.0 + rng.uniform(-1, 1), 0.0)
    x, y, z = size / [2, 2, 1]
    house = [gable((-x, -y, -1.0), (x, y, z), rng.uniform(2.0, 4.0), 0.4)]
    house.append(box((x * 0.3, 0.5, z), (x * 0.3 + 0.7, 1.2, z + 3.8)))
    if rng.random() < 0.6:
        house.append(box((x, -y * 0.7, -1.0), (x + 3.0, y * 0.4, 2.6)))
    parts = [merge(house).moved(middle, turn)]
    if rng.random() < 0.7:
        parts.append(tree(rng, rng.uniform(5.0, 9.0)).moved((2.2, 18.5, -0.3)))
    if rng.random() < 0.6:
        parts.append(car().moved((rng.uniform(4, 16), 20.6, 0.0), rng.normal(0.0, 0.03)))
    return parts
