# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is drawn, cut and computed from finished maps: sections and plans, occupancy grids, terrain, volumes, meshes."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.products.area import Area
    from bentwing.products.contours import Contour, contour_lines
    from bentwing.products.cutting import Section
    from bentwing.products.ground import Terrain, ground_cells
    from bentwing.products.lines import fit_lines
    from bentwing.products.mesh import Mesh, mesh_of, write_mesh
    from bentwing.products.occupancy import OccupancyGrid, occupancy_of, write_occupancy
    from bentwing.products.open3d_clouds import from_open3d, to_open3d
    from bentwing.products.oriented import OrientedPoints, oriented_points
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
            "products.mesh": ["Mesh", "mesh_of", "write_mesh"],
            "products.occupancy": ["OccupancyGrid", "occupancy_of", "write_occupancy"],
            "products.open3d_clouds": ["from_open3d", "to_open3d"],
            "products.oriented": ["OrientedPoints", "oriented_points"],
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
    "Mesh",
    "OccupancyGrid",
    "OrientedPoints",
    "Section",
    "Terrain",
    "Volume",
    "contour_lines",
    "fit_lines",
    "from_open3d",
    "ground_cells",
    "measure_volume",
    "mesh_of",
    "occupancy_of",
    "oriented_points",
    "section_of",
    "terrain_of",
    "to_open3d",
    "write_mesh",
    "write_occupancy",
    "write_section",
    "write_terrain",
]
