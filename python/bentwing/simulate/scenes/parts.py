# SPDX-License-Identifier: MIT OR Apache-2.0
"""What several scenes are made of: facades, trees, furniture, cars."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.scenes.mesh import (
    FOLIAGE,
    GLASS,
    Mesh,
    ball,
    box,
    column,
    merge,
    quad,
    smooth_noise,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

Opening = tuple[float, float, float, float]
"""Left, right, bottom and top of an opening in a wall, m."""


def facade(length: float, height: float, openings: Sequence[Opening], reveal: float) -> Mesh:
    """Build a wall in the plane y = 0 over 0 ≤ x ≤ `length`, seen from −y.

    Each opening is closed by a pane (or a door) `reveal` metres behind the wall's face.
    """
    xs = sorted({0.0, length, *(v for o in openings for v in o[:2])})
    zs = sorted({0.0, height, *(v for o in openings for v in o[2:])})
    parts = [_reveal(opening, reveal) for opening in openings]
    for x0, x1 in pairwise(xs):
        for z0, z1 in pairwise(zs):
            centre = ((x0 + x1) / 2, (z0 + z1) / 2)
            if not any(_inside(centre, opening) for opening in openings):
                parts.append(quad([(x0, 0, z0), (x1, 0, z0), (x1, 0, z1), (x0, 0, z1)]))
    return merge(parts)


def _inside(point: tuple[float, float], opening: Opening) -> bool:
    left, right, bottom, top = opening
    return left < point[0] < right and bottom < point[1] < top


def _reveal(opening: Opening, d: float) -> Mesh:
    x0, x1, z0, z1 = opening
    pane = quad([(x0, d, z0), (x1, d, z0), (x1, d, z1), (x0, d, z1)])
    return merge(
        [
            # A door reaches to the ground.
            pane.made_of(GLASS) if z0 > 0.0 else pane,
            quad([(x0, 0, z0), (x0, d, z0), (x0, d, z1), (x0, 0, z1)]),
            quad([(x1, d, z0), (x1, 0, z0), (x1, 0, z1), (x1, d, z1)]),
            quad([(x0, 0, z0), (x1, 0, z0), (x1, d, z0), (x0, d, z0)]),
            quad([(x0, d, z1), (x1, d, z1), (x1, 0, z1), (x0, 0, z1)]),
        ]
    )


def windows(length: float, sills: Sequence[float], spacing: float) -> list[Opening]:
    """Rows of windows 1.1 m wide and 1.4 m high at the given sill heights."""
    count = int((length - 1.5) // spacing)
    first = (length - (count - 1) * spacing) / 2 - 0.55
    lefts = [first + i * spacing for i in range(count)]
    return [(left, left + 1.1, sill, sill + 1.4) for sill in sills for left in lefts]


def tree(rng: np.random.Generator, height: float) -> Mesh:
    """Build a trunk and a bumpy crown, standing on the origin."""
    trunk = column((0.09 * height**0.5, 0.05 * height**0.5), 0.6 * height, 9)
    crown = ball([0.24 * height, 0.24 * height, 0.3 * height], 9, smooth_noise(rng, 0.8, 0.12, 3))
    return merge([trunk, crown.moved((0.0, 0.0, 0.7 * height)).made_of(FOLIAGE)])


def car() -> Mesh:
    """Build a car-like pair of boxes on wheels of 0.2 m, standing on the origin, front along x."""
    body = box((-2.1, -0.85, 0.2), (2.1, 0.85, 0.85))
    cabin = box((-1.3, -0.75, 0.85), (0.9, 0.75, 1.45))
    wheels = [
        box((x - 0.3, y - 0.1, 0.0), (x + 0.3, y + 0.1, 0.2))
        for x in (-1.3, 1.3)
        for y in (-0.7, 0.7)
    ]
    return merge([body, cabin, *wheels])


def table(length: float, width: float) -> Mesh:
    """Build a table 0.74 m high, centred on the origin."""
    x, y = length / 2, width / 2
    legs = [
        box((i * (x - 0.06) - 0.03, j * (y - 0.06) - 0.03, 0.0),
            (i * (x - 0.06) + 0.03, j * (y - 0.06) + 0.03, 0.71))
        for i in (-1, 1)
        for j in (-1, 1)
    ]  # fmt: skip
    return merge([box((-x, -y, 0.71), (x, y, 0.74)), *legs])


def shelf(length: float, height: float) -> Mesh:
    """Build an open shelf 0.35 m deep with its back at y = 0, from x = 0, seen from −y."""
    boards = [box((0, -0.35, z), (length, 0, z + 0.03)) for z in np.arange(0.05, height, 0.42)]
    sides = [box((x, -0.35, 0), (x + 0.03, 0, height)) for x in (0.0, length - 0.03)]
    return merge([*boards, *sides, box((0, -0.02, 0), (length, 0, height))])
