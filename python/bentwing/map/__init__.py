# SPDX-License-Identifier: MIT OR Apache-2.0
"""The map: from a trajectory and batches to points; cleaned, thinned, written and read."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.map.clean import CleanSettings
    from bentwing.map.formats import MAP_FORMATS, MapFormat
    from bentwing.map.read import MapPart, read_parts, read_points
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "map.clean": ["CleanSettings"],
            "map.formats": ["MAP_FORMATS", "MapFormat"],
            "map.read": ["MapPart", "read_parts", "read_points"],
        },
    )

__all__ = [
    "MAP_FORMATS",
    "CleanSettings",
    "MapFormat",
    "MapPart",
    "read_parts",
    "read_points",
]
