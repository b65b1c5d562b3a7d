# SPDX-License-Identifier: MIT OR Apache-2.0
"""Areas from files that geographic and drawing programs write: GeoJSON and DXF."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import InputError, UsageError
from bentwing.base.regular_file import require_regular, require_there
from bentwing.map.polygon import Polygon

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from ezdxf.document import Drawing

DEGREES = 4326
_GEOJSON = {".geojson", ".json"}
_MOST_BYTES = 2**26
_MOST_CORNERS = 1_000_000
_FARTHEST = 1e9  # m or degrees; coordinates of projected systems have eight digits before the point
_FLAT = 0.005  # m; how far the chords of an arc may be off it
_FINEST = 1e-6  # of the size of a line: a drawing in light years has no millimetres
# What text that is no area, or a damaged drawing, ends in.
_NO_AREA = (
    ArithmeticError, AssertionError, AttributeError, LookupError, OSError, RecursionError, TypeError, ValueError,
)  # fmt: skip
_DRAWN = {"LWPOLYLINE", "POLYLINE", "CIRCLE", "ELLIPSE", "SPLINE"}


@dataclass(frozen=True, slots=True)
class AreaFile:
    """What a file says.

    Attributes
    ----------
    polygons : one or more
    epsg : of their coordinates, where the file says it; `DEGREES` are longitude and latitude
    can_be_degrees : whether GeoJSON without a system may be in degrees, as RFC 7946 says it is
    """

    polygons: tuple[Polygon, ...]
    epsg: int | None = None
    can_be_degrees: bool = False


def read_area(path: Path) -> AreaFile:
    """Read the areas in a file.

    In a drawing, closed lines inside of others are holes; its unit becomes metres where it names one.

    Raises
    ------
    UsageError
        If the file is of another kind, or ezdxf is missing for a drawing.
    InputError
        If it cannot be read or holds no area.
    """
    require_there(path)
    require_regular(path, _MOST_BYTES)
    suffix = path.suffix.lower()
    if suffix not in {*_GEOJSON, ".dxf"}:
        msg = f"{path}: areas are read from GeoJSON (.geojson) and DXF (.dxf); convert it first"
        raise UsageError(msg)
    try:
        found = _drawing(path) if suffix == ".dxf" else _geojson(path)
    except _NO_AREA as error:
        msg = f"{path}: not readable as an area ({error})"
        raise InputError(msg) from error
    if not found.polygons:
        what = "closed line" if suffix == ".dxf" else "Polygon or MultiPolygon"
        msg = f"{path}: holds no {what}; draw the area as one"
        raise InputError(msg)
    rings = [ring for polygon in found.polygons for ring in polygon.rings]
    farthest = max(float(np.abs(ring).max()) for ring in rings)
    if farthest > _FARTHEST:
        msg = (
            f"{path}: has a corner at {farthest:.3g}, which is not on Earth; check unit and system"
        )
        raise InputError(msg)
    if sum(map(len, rings)) > _MOST_CORNERS:
        msg = f"{path}: has more than {_MOST_CORNERS:,} corners; simplify the area"
        raise InputError(msg)
    return found


def _geojson(path: Path) -> AreaFile:
    described = json.loads(path.read_text(encoding="utf-8-sig"))
    polygons = tuple(_polygons(described))
    epsg = _system(described.get("crs"))
    corners = [np.abs(ring) <= [180.0, 90.0] for p in polygons for ring in p.rings]
    return AreaFile(polygons, epsg, epsg is None and all(ring.all() for ring in corners))


def _polygons(item: dict[str, Any]) -> Iterator[Polygon]:
    kind = item["type"]
    if kind == "FeatureCollection":
        for feature in item["features"]:
            yield from _polygons(feature)
    elif kind == "Feature":
        if item["geometry"] is not None:
            yield from _polygons(item["geometry"])
    elif kind == "GeometryCollection":
        for geometry in item["geometries"]:
            yield from _polygons(geometry)
    elif kind in {"Polygon", "MultiPolygon"}:
        areas = [item["coordinates"]] if kind == "Polygon" else item["coordinates"]
        for rings in areas:
            # a third number is a height, of which an area has none
            yield Polygon.of(*([corner[:2] for corner in ring] for ring in rings))


def _system(crs: dict[str, Any] | None) -> int | None:
    """Return the EPSG code in the member `crs` of older files, which QGIS goes on writing."""
    if crs is None:
        return None
    name = str(crs["properties"]["name"])
    if name.endswith("CRS84"):
        return DEGREES
    code = re.search(r"EPSG:+(\d+)$", name)
    if code is None:
        msg = f"its system {name!r} is none of EPSG"
        raise ValueError(msg)
    return int(code.group(1))


def _drawing(path: Path) -> AreaFile:
    try:
        from ezdxf import recover
        from ezdxf.lldxf.const import DXFError
    except ImportError:
        msg = (
            f"{path}: reading a DXF needs the package ezdxf, which is not installed; run "
            "`pip install bentwing[products]`, or export the area as GeoJSON"
        )
        raise UsageError(msg) from None
    try:
        return _lines_of(recover.readfile(path)[0])
    except DXFError as error:
        msg = f"no DXF ({error})"
        raise ValueError(msg) from error


def _lines_of(drawing: Drawing) -> AreaFile:
    from ezdxf.enums import InsertUnits
    from ezdxf.path import make_path
    from ezdxf.units import conversion_factor

    unit = InsertUnits(drawing.units)
    metres = conversion_factor(unit, InsertUnits.Meters) if unit else 1.0
    rings = []
    for entity in drawing.modelspace():
        if entity.dxftype() not in _DRAWN:
            continue
        line = make_path(entity)
        if line.is_closed:
            reach = np.ptp([(p.x, p.y) for p in line.control_vertices()], axis=0).max()
            flat = max(_FLAT / metres, _FINEST * float(reach))
            corners = np.array([(p.x, p.y) for p in line.flattening(flat)])
            rings.append(corners * metres)
    return AreaFile((Polygon(tuple(rings)),) if rings else ())
