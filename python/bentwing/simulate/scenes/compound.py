# SPDX-License-Identifier: MIT OR Apache-2.0
"""An industrial compound as in Kaul 2015, figures 19a and 21: a large yard between tall buildings."""

from __future__ import annotations

import numpy as np

from bentwing.simulate.scenes.courtyard import facades
from bentwing.simulate.scenes.mesh import Mesh, box, column, gable, ground, merge, smooth_noise
from bentwing.simulate.scenes.parts import car, tree
from bentwing.simulate.scenes.world import Site


def compound(rng: np.random.Generator) -> Site:
    """Open above; about 50 × 35 m, buildings 7.5 to 11.5 m high."""
    length, width = rng.uniform(48.0, 52.0), rng.uniform(33.0, 37.0)
    floor = ground((-2.0, length + 2.0), (-2.0, width + 2.0), 0.5, smooth_noise(rng, 8.0, 0.03))
    walls = facades(rng, (length, width), (7.5, 11.5), (1.1, 4.2))
    mesh = merge([floor, *walls, *_stores(rng, length, width), *_small_things(rng, length, width)])
    high = (length - 2.5, width - 2.5, 7.0)
    return Site(mesh, (2.5, 2.5, 1.6), high, pad_below=0.2, speed=1.2)


def _stores(rng: np.random.Generator, length: float, width: float) -> list[Mesh]:
    """Place a shed and shipping containers."""
    shed = gable((0.0, 0.0, -0.2), (6.0, 4.0, 3.0), 1.4, 0.3)
    parts = [shed.moved((length - 9.0, width - 7.0, 0.0), rng.uniform(-0.15, 0.15))]
    for x, y in ((0.22, 0.3), (0.28, 0.3), (0.62, 0.22)):
        at = (x * length + rng.uniform(-0.5, 0.5), y * width + rng.uniform(-1.0, 1.0), 0.0)
        container = box((-1.2, -3.0, -0.2), (1.2, 3.0, 2.6))
        parts.append(container.moved(at, rng.uniform(-0.2, 0.2)))
    return parts


def _small_things(rng: np.random.Generator, length: float, width: float) -> list[Mesh]:
    """Trees, cars, bollards in the middle, and crates."""
    parts = []
    for x, y in ((0.1, 0.85), (0.45, 0.88), (0.9, 0.2)):
        at = (x * length + rng.uniform(-1, 1), y * width + rng.uniform(-1, 1), -0.1)
        parts.append(tree(rng, rng.uniform(5.0, 7.5)).moved(at))
    for x in (0.2, 0.27, 0.34, 0.7):
        at = (x * length + rng.uniform(-0.5, 0.5), 0.78 * width, 0.0)
        parts.append(car().moved(at, np.pi / 2 + rng.uniform(-0.1, 0.1)))
    for k in range(6):
        post = column((0.08, 0.08), 1.1, 8)
        parts.append(post.moved((0.5 * length, (0.4 + 0.04 * k) * width, -0.1)))
    for size in rng.uniform(0.5, 1.3, size=(7, 3)):
        at = (rng.uniform(0.3, 0.8) * length, rng.uniform(0.3, 0.6) * width, -0.1)
        parts.append(box((0, 0, 0), size).moved(at, rng.uniform(0, np.pi)))
    return parts
