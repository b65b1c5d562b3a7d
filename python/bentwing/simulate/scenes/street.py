# SPDX-License-Identifier: MIT OR Apache-2.0
"""A street of one kilometre between houses, with parked cars, trees, lamps and side streets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.scenes.mesh import Mesh, box, column, ground, merge, smooth_noise
from bentwing.simulate.scenes.parts import car, facade, tree, windows
from bentwing.simulate.scenes.world import Site

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

LENGTH = 1000.0
BEYOND = 40.0
"""m, how far the street goes on at both ends."""
LANE = -1.6
"""m, left of the middle: cars drive on the right."""
SPEED = 10.0
DOOR = (1.0, 2.1, -0.6, 2.2)


class Course:
    """The middle of the street: y(x), its heading, and the ground's height."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._waves = 2 * np.pi / rng.uniform(280.0, 430.0, 2)
        self._sizes, self._phases = rng.uniform(4.0, 8.0, 2), rng.uniform(0.0, 2 * np.pi, 2)
        self._slow, self._rough = smooth_noise(rng, 150.0, 0.5), smooth_noise(rng, 5.0, 0.006)

    def height(self, xy: Array) -> Array:
        """Return the ground's height (N,), m, at `xy` (N, 2)."""
        return self._slow(xy) + self._rough(xy)

    def middle(self, x: Array) -> tuple[Array, Array]:
        """Return y and heading at `x` (N,)."""
        angles = np.outer(x, self._waves) + self._phases
        slope = (self._sizes * self._waves * np.cos(angles)).sum(axis=1)
        return (self._sizes * np.sin(angles)).sum(axis=1), np.arctan(slope)

    def beside(self, x: Array, left: Array | float) -> tuple[Array, Array]:
        """Return points (N, 3) on the ground that far left of the middle, and headings."""
        y, heading = self.middle(x)
        xy = np.column_stack([x - left * np.sin(heading), y + left * np.cos(heading)])
        return np.column_stack([xy, self.height(xy)]), heading

    def placed(self, part: Mesh, x: float, left: float, turned: float = 0.0) -> Mesh:
        """Return a part, made at the origin along x, where it stands."""
        at, heading = self.beside(np.array([x]), left)
        return part.moved(at[0], float(heading[0]) + turned)


def street(rng: np.random.Generator) -> Site:
    """Build the street; it bends by some degrees and is nearly level."""
    course = Course(rng)
    floor = ground((-BEYOND, LENGTH + BEYOND), (-55.0, 55.0), 2.0, course.height)
    parts = [floor]
    for side in (-1.0, 1.0):
        parts += _houses(rng, course, side)
        parts += _along(rng, course, side)
    road, _ = course.beside(np.arange(0.0, LENGTH, 2.0), LANE)
    low, high = (0.0, -20.0, 2.0), (LENGTH, 20.0, 4.0)
    points = tuple((x, y, z) for x, y, z in road.tolist())
    return Site(merge(parts), low, high, pad_below=2.0, speed=SPEED, road=points)


def _houses(rng: np.random.Generator, course: Course, side: float) -> list[Mesh]:
    """Rows of houses, some with a garden or a side street between them."""
    parts, x = [], -BEYOND
    while x < LENGTH + BEYOND:
        length, height = rng.uniform(10.0, 22.0), rng.uniform(5.0, 13.0)
        setback = rng.uniform(8.0, 10.5)
        house = _house(rng, length, height)
        # Its front looks to the street: on the right it is turned about, and begins at its end.
        start = (x, 0.0) if side > 0 else (x + length, np.pi)
        parts.append(course.placed(house, start[0], side * setback, start[1]))
        x += length
        draw = rng.random()
        if draw < 0.10:
            x += 14.0
        elif draw < 0.4:
            gap = rng.uniform(3.0, 10.0)
            hedge = box((0.0, -0.4, -0.5), (gap, 0.4, rng.uniform(0.8, 1.6)))
            parts.append(course.placed(hedge, x, side * setback))
            x += gap
    return parts


def _house(rng: np.random.Generator, length: float, height: float) -> Mesh:
    """Build a front along x, seen from −y, with the house behind it."""
    sills = np.arange(1.2, height - 1.8, 3.0).tolist()
    openings = [o for o in windows(length, sills, rng.uniform(2.4, 3.2)) if o[0] > DOOR[1] + 0.2]
    front = facade(length, height, [DOOR, *openings], rng.uniform(0.1, 0.2))
    # The front begins at its foot; the walls go on below the ground.
    behind = box((0.0, 0.25, -1.0), (length, rng.uniform(8.0, 12.0), height))
    return merge([front, box((0.0, 0.0, -1.0), (length, 0.25, 0.0)), behind])


def _along(rng: np.random.Generator, course: Course, side: float) -> list[Mesh]:
    """Parked cars, and lamps and trees behind them."""
    parts = []
    x = -20.0
    while x < LENGTH + 20.0:
        if rng.random() < 0.6:
            aside = side * (4.4 + rng.uniform(-0.15, 0.15))
            parts.append(course.placed(car(), x, aside, rng.normal(0.0, 0.02)))
        x += rng.uniform(5.5, 9.0)
    for x in np.arange(-15.0, LENGTH + 20.0, 12.0):
        at = x + rng.uniform(-2.0, 2.0)
        if rng.random() < 0.5:
            part = tree(rng, rng.uniform(4.5, 7.0))
        else:
            part = column((0.09, 0.06), 6.0, 8)
        parts.append(course.placed(part.moved((0.0, 0.0, -0.2)), at, side * 6.4))
    return parts
