# SPDX-License-Identifier: MIT OR Apache-2.0
"""An area in plan: read from a file, and which share of each cell it covers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.arguments import finite_array
from bentwing.base.errors import InputError
from bentwing.base.value import Value
from bentwing.map import polygon_file
from bentwing.map.polygon import Polygon

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

_FINER = 10  # places along each edge of a cell that are looked at


@dataclass(frozen=True, slots=True, eq=False)
class Area(Value):
    """A polygon, with holes if it has further rings.

    Attributes
    ----------
    rings : (M, 2) m each, corners one after the other, the first not repeated
    """

    rings: tuple[Array, ...]

    @classmethod
    def of(cls, rings: Sequence[ArrayLike]) -> Area:
        """Take corners (M, 2) m of each ring.

        Raises
        ------
        ValueError
            If a ring has fewer than three corners or the area is nothing.
        """
        arrays = []
        for number, ring in enumerate(rings):
            corners = finite_array(f"rings[{number}]", ring, None, 2)
            if len(corners) > 1 and np.array_equal(corners[0], corners[-1]):
                corners = corners[:-1]
            if len(corners) < 3:
                msg = f"rings[{number}]: expected three corners or more, got {len(corners)}"
                raise ValueError(msg)
            arrays.append(corners)
        area = cls(tuple(arrays))
        if not arrays or area.size <= 0:
            msg = "rings: expected a polygon around something, got an area of nothing"
            raise ValueError(msg)
        return area

    @property
    def size(self) -> float:
        """Area, m²."""
        outer, *holes = (abs(_signed(ring)) for ring in self.rings)
        return outer - sum(holes)

    def moved(self, by: Array) -> Area:
        """Return the area moved by (2,) m."""
        return Area(tuple(ring + by for ring in self.rings))

    def holds(self, places: Array) -> NDArray[np.bool_]:
        """Tell which places (N, 2) m are inside."""
        return Polygon(self.rings).contains(places)

    def shares(self, corner: Array, shape: tuple[int, int], cell: float) -> Array:
        """Return the covered area (H, W) m² of the cells of a grid; together they are the area."""
        height, width = shape
        covered = np.zeros(shape)
        steps = (np.arange(_FINER) + 0.5) / _FINER
        x, y = (np.arange(n) * cell + at for n, at in zip((width, height), corner, strict=True))
        for dx in steps:
            for dy in steps:
                grid = np.stack(np.meshgrid(x + dx * cell, y + dy * cell), axis=2)
                covered += self.holds(grid.reshape(-1, 2)).reshape(shape)
        total = covered.sum()
        return covered * (self.size / total) if total else covered


def read_area(path: Path) -> Area:
    """Read the one polygon of a GeoJSON or DXF file, in the coordinates of the map.

    Raises
    ------
    UsageError, InputError
        If the file is not readable, or holds no polygon or several.
    """
    polygons = polygon_file.read_area(path).polygons
    if len(polygons) != 1:
        msg = f"{path}: holds {len(polygons)} polygons; give a file with one"
        raise InputError(msg)
    try:
        return Area.of(polygons[0].rings)
    except ValueError as error:
        msg = f"{path}: not readable as an area ({error})"
        raise InputError(msg) from error


def _signed(ring: Array) -> float:
    x, y = (ring - ring.mean(axis=0)).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
