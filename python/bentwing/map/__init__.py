# SPDX-License-Identifier: MIT OR Apache-2.0
"""The map: from a trajectory and batches to points; cleaned, thinned, written and read."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.map.chunk import MapChunk
    from bentwing.map.clean import CleanSettings
    from bentwing.map.crop import Crop
    from bentwing.map.formats import MAP_FORMATS, MapFormat
    from bentwing.map.polygon import Polygon
    from bentwing.map.read import MapPart, read_parts, read_points
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "map.chunk": ["MapChunk"],
            "map.clean": ["CleanSettings"],
            "map.crop": ["Crop"],
            "map.formats": ["MAP_FORMATS", "MapFormat"],
            "map.polygon": ["Polygon"],
            "map.read": ["MapPart", "read_parts", "read_points"],
        },
    )

__all__ = [
    "MAP_FORMATS",
    "CleanSettings",
    "Crop",
    "MapChunk",
    "MapFormat",
    "MapPart",
    "Polygon",
    "read_parts",
    "read_points",
]
