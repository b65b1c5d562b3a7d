# SPDX-License-Identifier: MIT OR Apache-2.0
"""An area in plan: read from GeoJSON, and which share of each cell it covers."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.arguments import finite_array
from bentwing.base.errors import InputError
from bentwing.base.regular_file import require_regular
from bentwing.base.value import Value

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

_FINER = 10  # places along each edge of a cell that are looked at
_LARGEST = 2**26  # bytes of a file


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
        inside = np.zeros(len(places), np.bool_)
        x, y = places.T
        for ring in self.rings:
            for (x0, y0), (x1, y1) in zip(ring, np.roll(ring, -1, axis=0), strict=True):
                between = (y0 <= y) != (y1 <= y)
                with np.errstate(divide="ignore", invalid="ignore"):
                    inside ^= between & (x < x0 + (y - y0) / (y1 - y0) * (x1 - x0))
        return inside

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
    """Read the one polygon of a GeoJSON file, in the coordinates of the map.

    Raises
    ------
    InputError
        If the file is not readable, or holds no polygon or several.
    """
    try:
        require_regular(path)
        if path.stat().st_size > _LARGEST:
            msg = f"{path}: has more than {_LARGEST} bytes; give a file with one polygon"
            raise InputError(msg)
        polygons = list(_polygons(json.loads(path.read_text(encoding="utf-8"))))
        if len(polygons) == 1:
            return Area.of(polygons[0])
    except OSError as error:
        msg = f"{path}: not readable ({error.strerror})"
        raise InputError(msg) from error
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        msg = f"{path}: not readable as GeoJSON ({str(error)[:200]}); give a file with one polygon"
        raise InputError(msg) from error
    msg = f"{path}: holds {len(polygons)} polygons; give a file with one"
    raise InputError(msg)


def _polygons(found: Any) -> Any:  # noqa: ANN401 - whatever is in the file
    kind = found["type"]
    if kind == "FeatureCollection":
        for feature in found["features"]:
            yield from _polygons(feature)
    elif kind == "Feature":
        yield from _polygons(found["geometry"])
    elif kind == "Polygon":
        yield [[corner[:2] for corner in ring] for ring in found["coordinates"]]
    elif kind == "MultiPolygon":
        for rings in found["coordinates"]:
            yield [[corner[:2] for corner in ring] for ring in rings]


def _signed(ring: Array) -> float:
    x, y = (ring - ring.mean(axis=0)).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
