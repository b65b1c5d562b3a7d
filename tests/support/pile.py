# SPDX-License-Identifier: MIT OR Apache-2.0
"""A yard between walls with a pile of known volume, or before the pile was there."""

from __future__ import annotations

import numpy as np

from bentwing.simulate.scenes import Site
from bentwing.simulate.scenes.courtyard import facades
from bentwing.simulate.scenes.mesh import box, gable, ground, merge
from bentwing.simulate.scenes.parts import car, tree

LENGTH, WIDTH, STEP = 26.0, 22.0, 0.1
RADIUS, HEIGHT = 4.0, 1.9  # m
MIDDLE = np.array([LENGTH / 2, WIDTH / 2])


def pile_on(places):
    """Heights (N,) m of a heap with a rounded top and an uneven side, zero from `RADIUS` on."""
    x, y = ((places - MIDDLE) / RADIUS).T
    angle = np.arctan2(y, x)
    reach = np.clip(np.hypot(x, y) * (1.0 + 0.08 * np.cos(3 * angle)) * 1.08, 0.0, 1.0)
    return HEIGHT * (1.0 - reach**2) ** 1.5


def _ground(height):
    return ground((0.0, LENGTH), (0.0, WIDTH), STEP, height)


def volume() -> float:
    """Of the pile as triangles, m³."""
    mesh = _ground(pile_on)
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    ab, ac = (b - a)[:, :2], (c - a)[:, :2]
    areas = 0.5 * np.abs(ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0])
    return float((areas * (a[:, 2] + b[:, 2] + c[:, 2]) / 3).sum())


def yard(*, with_pile: bool):
    """Return the builder of a scene; all but the pile is the same for every seed."""

    def build(_rng: np.random.Generator) -> Site:
        rng = np.random.default_rng(7)
        walls = facades(rng, (LENGTH, WIDTH), (5.0, 8.0), (1.1, 4.2))
        floor = _ground(pile_on if with_pile else lambda places: np.zeros(len(places)))
        things = [
            box((0, 0, -0.1), rng.uniform(0.5, 1.6, 3)).moved((*at, 0.0), rng.uniform(0, np.pi))
            for at in (
                (2.0, 4.0),
                (22.0, 3.5),
                (23.5, 12.0),
                (1.5, 17.0),
                (12.0, 1.5),
                (16.0, 20.5),
            )
        ]
        things += [tree(rng, 6.0).moved((*at, -0.1)) for at in ((4.0, 19.0), (22.5, 7.0))]
        things += [car().moved((*at, 0.0), 1.4) for at in ((7.0, 2.5), (19.5, 19.0))]
        things.append(gable((0, 0, -0.2), (3.6, 2.6, 2.2), 1.0, 0.25).moved((20.5, 14.5, 0.0), 0.1))
        mesh = merge([floor, *walls, *things])
        x, y = MIDDLE
        around = tuple(
            (x + a, y + b, z)
            for a, b, z in ((-6, -5.5, 3), (6, -5.5, 5), (6, 5.5, 3), (-6, 5.5, 5))
        )
        low, high = (2.5, 2.5, 2.6), (LENGTH - 2.5, WIDTH - 2.5, 5.5)
        return Site(mesh, low, high, pad_below=0.2, speed=1.6, route=around)

    return build
