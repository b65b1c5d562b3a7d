# SPDX-License-Identifier: MIT OR Apache-2.0
"""Areas of files in the coordinates of an export."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.base.geodesy import ProjectedSystem
from bentwing.map.polygon_file import DEGREES, read_area

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.map.polygon import Polygon
    from bentwing.run.export.coordinates import Target


def area_in(target: Target, path: Path) -> tuple[Polygon, ...]:
    """Read the areas in a file; they are seen from above, so their heights count nothing.

    GeoJSON that names no system is in degrees, as RFC 7946 says, where the export is on the Earth and its numbers
    can be degrees; else it has the coordinates of the export, as drawings have.

    Raises
    ------
    UsageError, InputError
        If the file cannot be used, or its system cannot be changed into that of the export.
    """
    found = read_area(path)
    system = target.system
    epsg = found.epsg
    if epsg is None and found.can_be_degrees and system is not None:
        epsg = DEGREES
    if epsg is None or (system is not None and epsg == system.epsg):
        return found.polygons
    if system is None:
        msg = (
            f"{path}: is in EPSG:{epsg}, but the export is in a frame of its own; draw the area in "
            "that frame, without a system"
        )
        raise UsageError(msg)
    own = None if epsg == DEGREES else ProjectedSystem.of_epsg(epsg)

    def moved(corners: NDArray[np.float64]) -> NDArray[np.float64]:
        flat = np.column_stack([corners, np.zeros(len(corners))])
        there = system.from_geodetic(flat) if own is None else own.to(system, flat)
        return np.ascontiguousarray(there[:, :2])

    return tuple(polygon.mapped(moved) for polygon in found.polygons)
