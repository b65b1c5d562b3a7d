# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is drawn, cut and computed from finished maps: sections, plans and occupancy grids."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.products.cutting import Section
    from bentwing.products.lines import fit_lines
    from bentwing.products.occupancy import OccupancyGrid, occupancy_of, write_occupancy
    from bentwing.products.plane import CutPlane
    from bentwing.products.section import section_of, write_section
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "products.cutting": ["Section"],
            "products.lines": ["fit_lines"],
            "products.occupancy": ["OccupancyGrid", "occupancy_of", "write_occupancy"],
            "products.plane": ["CutPlane"],
            "products.section": ["section_of", "write_section"],
        },
    )

__all__ = [
    "CutPlane",
    "OccupancyGrid",
    "Section",
    "fit_lines",
    "occupancy_of",
    "section_of",
    "write_occupancy",
    "write_section",
]
