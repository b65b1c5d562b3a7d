# SPDX-License-Identifier: MIT OR Apache-2.0
"""Areas seen from above."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np

from bentwing.base.arguments import finite_array

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Polygon:
    """Rings of corners; inside is what an odd number of rings surrounds, so that inner rings are holes.

    Attributes
    ----------
    rings : each (K, 2), m, K >= 3; the last corner need not repeat the first

    Raises
    ------
    ValueError, TypeError
        If there is no ring, a ring has fewer than three corners, or a number is not finite.
    """

    rings: tuple[Array, ...]

    def __post_init__(self) -> None:
        rings = tuple(_ring(i, ring) for i, ring in enumerate(self.rings))
        if not rings:
            msg = "rings: expected one ring of corners or more, got none"
            raise ValueError(msg)
        object.__setattr__(self, "rings", rings)

    @classmethod
    def of(cls, *rings: ArrayLike) -> Polygon:
        """Make an area of rings of corners, as lists or arrays (K, 2)."""
        return cls(tuple(np.asarray(ring, np.float64) for ring in rings))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Polygon):
            return NotImplemented
        same = len(self.rings) == len(other.rings)
        return same and all(map(np.array_equal, self.rings, other.rings))

    __hash__ = None  # type: ignore[assignment]

    @property
    def low(self) -> Array:
        """Lowest x and y, (2,) m."""
        return cast("Array", np.concatenate(self.rings).min(axis=0))

    @property
    def high(self) -> Array:
        """Highest x and y, (2,) m."""
        return cast("Array", np.concatenate(self.rings).max(axis=0))

    def mapped(self, to: Callable[[Array], Array]) -> Polygon:
        """Return the area in other coordinates; `to` takes and returns corners (K, 2)."""
        return Polygon(tuple(to(ring) for ring in self.rings))

    def contains(self, points: Array) -> NDArray[np.bool_]:
        """Whether each of points (N, 2) is inside, by the parity of crossings of a ray along x.

        Of a border that two areas share, a point on it is in one of them.
        """
        order = np.argsort(points[:, 1], kind="stable")
        x, y = points[order].T
        odd = np.zeros(len(points), np.bool_)
        for ring in self.rings:
            for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
                low, high = (a, b) if a[1] <= b[1] else (b, a)
                # an edge is crossed by rays between its ends only, which follow each other in this order
                first, last = np.searchsorted(y, [low[1], high[1]])
                if first < last:
                    shares = (y[first:last] - low[1]) / (high[1] - low[1])
                    odd[first:last] ^= x[first:last] < low[0] + shares * (high[0] - low[0])
        inside = np.empty(len(points), np.bool_)
        inside[order] = odd
        return inside


def contained(polygons: Sequence[Polygon], points: Array) -> NDArray[np.bool_]:
    """Whether each of points (N, 2) is in one of the areas."""
    inside = np.zeros(len(points), np.bool_)
    for polygon in polygons:
        left = np.flatnonzero(~inside)
        inside[left] = polygon.contains(points[left])
    return inside


def _ring(number: int, ring: ArrayLike) -> Array:
    corners = finite_array(f"rings[{number}]", ring, None, 2)
    if len(corners) > 1 and np.array_equal(corners[0], corners[-1]):
        corners = corners[:-1]
    if len(corners) < 3:
        msg = f"rings[{number}]: expected three corners or more, got {len(corners)}"
        raise ValueError(msg)
    return corners
