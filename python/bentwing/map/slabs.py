# SPDX-License-Identifier: MIT OR Apache-2.0
"""Cuts a map into slabs across its longest axis, each with few enough points to be worked on at once."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

STEP = 0.25  # m, between the places where a slab or what is around it may end
HALO = 1.25  # m, that other points may help; a whole number of steps
_AROUND = round(HALO / STEP)
_NARROWEST = 4  # steps


class Extent:
    """How many points there are in every step along each axis."""

    def __init__(self) -> None:
        self._axes: tuple[Counter[int], ...] = (Counter(), Counter(), Counter())

    def add(self, points: NDArray[np.float64]) -> None:
        """Count points (N, 3) m, at least one."""
        for axis, counted in enumerate(self._axes):
            first, steps = _steps(points[:, axis])
            for step, number in enumerate(np.bincount(steps).tolist(), first):
                if number:
                    counted[step] += number

    def slabs(self, most: int) -> Slabs:
        """Cut so that a group has at most so many points, with those around it."""
        axis = int(np.argmax([len(counted) for counted in self._axes]))
        counted = self._axes[axis]
        first, end = (min(counted), max(counted) + 1) if counted else (0, 1)
        before = np.cumsum([0, *(counted[step] for step in range(first, end))])

        def near(begin: int, last: int) -> int:
            low, high = max(begin - _AROUND, first), min(last + _AROUND, end)
            return int(before[high - first] - before[low - first])

        ends, turns, begin = [], [], first
        while begin < end:
            last = min(begin + _NARROWEST, end)
            while last < end and near(begin, last + 1) <= most:
                last += 1
            ends.append(last)
            turns.append(-(-near(begin, last) // most))
            begin = last
        return Slabs(axis, np.array(ends[:-1], np.int64), tuple(turns))


@dataclass(frozen=True, slots=True)
class Part:
    """Points of a chunk that are worked on together.

    Attributes
    ----------
    number : of the group with which they are
    rows : (K,), of the points
    own : (K,) bool, whether each belongs to the group, or is around it only
    """

    number: int
    rows: NDArray[np.intp]
    own: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Slabs:
    """Groups of points, each of which knows what is around it.

    A slab with too many points is several groups, each of every k-th point there and around.

    Attributes
    ----------
    axis : across which the slabs are cut
    begins : (S - 1,) steps, where the second slab and those behind it begin
    turns : groups of each slab
    """

    axis: int
    begins: NDArray[np.int64]
    turns: tuple[int, ...]

    @property
    def n_groups(self) -> int:
        """Number of groups."""
        return sum(self.turns)

    def parts(self, points: NDArray[np.float64]) -> Iterator[Part]:
        """Yield the parts of a chunk's points (N, 3) m, by their groups.

        Every look at the same chunk finds the same parts.
        """
        first, steps = _steps(points[:, self.axis])
        # A narrow type is sorted several times as fast.
        narrow = steps.astype(np.min_scalar_type(int(steps.max())))
        order = np.argsort(narrow, kind="stable")
        ends = self.begins - first
        cuts, low, high = (
            _places(steps, order, ends + beyond) for beyond in (0, -_AROUND, _AROUND)
        )
        number = 0
        for slab, turns in enumerate(self.turns):
            begin, last = low[slab], high[slab + 1]
            own = np.zeros(last - begin, np.bool_)
            own[cuts[slab] - begin : cuts[slab + 1] - begin] = True
            for turn in range(turns):
                rows = order[begin + turn : last : turns]
                if len(rows):
                    yield Part(number + turn, rows, own[turn::turns])
            number += turns


def _steps(along: NDArray[np.float64]) -> tuple[int, NDArray[np.intp]]:
    """Return the first step and by how many each point is behind it."""
    steps = np.floor(along / STEP).astype(np.intp)
    first = int(steps.min())
    return first, steps - first


def _places(steps: NDArray[np.intp], order: NDArray[np.intp], ends: NDArray[np.int64]) -> list[int]:
    """Return at which of the sorted points slabs begin, if they end there, and where the last one ends."""
    inner: list[int] = np.searchsorted(steps, ends, sorter=order).tolist()
    return [0, *inner, len(order)]
