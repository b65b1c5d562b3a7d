# SPDX-License-Identifier: MIT OR Apache-2.0
"""In which coordinate system a map says that it is, and how other files name it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import laspy

from bentwing.map.las_bounds import require_sound_las

if TYPE_CHECKING:
    from pathlib import Path

_CODE = re.compile(r'(?:ID|AUTHORITY)\[\s*"EPSG"\s*,\s*"?(\d+)"?\s*\]')
_WKT = 2112  # record id of a coordinate system in well-known text
_GEO_KEYS = 34735
_PROJECTED = 3072


def geojson_system(epsg: int | None) -> dict[str, Any]:
    """Return the member of GeoJSON that names a system, which GDAL and QGIS go by; none without one.

    RFC 7946 has degrees only, and others by agreement.
    """
    name = f"urn:ogc:def:crs:EPSG::{epsg}"
    return {} if epsg is None else {"crs": {"type": "name", "properties": {"name": name}}}


def epsg_of_map(path: Path) -> int | None:
    """Return the EPSG code of a LAS or LAZ file; None where it states none, and for other formats."""
    if path.suffix.lower() not in {".laz", ".las"}:
        return None
    require_sound_las(path)
    with laspy.open(path) as reader:
        records = [*reader.header.vlrs, *(reader.header.evlrs or [])]
    for record in records:
        if record.record_id == _WKT:
            text = record.record_data_bytes().decode("utf-8", errors="replace")
            # parts of a system have codes of their own; that of the whole stands last
            codes = _CODE.findall(_without_vertical(text))
            if codes:
                return int(codes[-1])
        if record.record_id == _GEO_KEYS:
            for key in record.geo_keys:
                if key.id == _PROJECTED:
                    return int(key.value_offset)
    return None


def _without_vertical(text: str) -> str:
    """Leave out the height part of a compound system, which stands last."""
    found = re.search(r"VERT(?:CRS|_CS)\[", text)
    return text if found is None else text[: found.start()]
