# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is drawn, cut and computed from finished maps: sections and plans, occupancy grids, terrain, volumes."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.products.area import Area
    from bentwing.products.contours import Contour, contour_lines
    from bentwing.products.cutting import Section
    from bentwing.products.ground import Terrain, ground_cells
    from bentwing.products.lines import fit_lines
    from bentwing.products.occupancy import OccupancyGrid, occupancy_of, write_occupancy
    from bentwing.products.plane import CutPlane
    from bentwing.products.section import section_of, write_section
    from bentwing.products.terrain import terrain_of, write_terrain
    from bentwing.products.volume import Volume, measure_volume
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "products.area": ["Area"],
            "products.contours": ["Contour", "contour_lines"],
            "products.cutting": ["Section"],
            "products.ground": ["Terrain", "ground_cells"],
            "products.lines": ["fit_lines"],
            "products.occupancy": ["OccupancyGrid", "occupancy_of", "write_occupancy"],
            "products.plane": ["CutPlane"],
            "products.section": ["section_of", "write_section"],
            "products.terrain": ["terrain_of", "write_terrain"],
            "products.volume": ["Volume", "measure_volume"],
        },
    )

__all__ = [
    "Area",
    "Contour",
    "CutPlane",
    "OccupancyGrid",
    "Section",
    "Terrain",
    "Volume",
    "contour_lines",
    "fit_lines",
    "ground_cells",
    "measure_volume",
    "occupancy_of",
    "section_of",
    "terrain_of",
    "write_occupancy",
    "write_section",
    "write_terrain",
]
