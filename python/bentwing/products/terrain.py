# SPDX-License-Identifier: MIT OR Apache-2.0
"""The terrain of a finished run, as a value and as files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import InputError, UsageError
from bentwing.base.new_file import require_new
from bentwing.base.progress import Progress
from bentwing.products.classified import write_classified
from bentwing.products.contours import require_contourpy, write_contours
from bentwing.products.finished_map import open_map_of
from bentwing.products.floor import EDGE
from bentwing.products.ground import BAND, Terrain, carried_on, ground_cells
from bentwing.products.section_drawing import DRAWINGS
from bentwing.products.sheet_dxf import require_ezdxf
from bentwing.products.surface import lowest_terrain, measured_surface, require_cell
from bentwing.report.geotiff import write_raster

if TYPE_CHECKING:
    from bentwing.products.finished_map import FinishedMap

_RASTER, _CLOUDS, _LINES = (".tif", ".tiff"), (".laz", ".las"), (".geojson", *DRAWINGS)
_BANDS = ((0.25, 0.25), (BAND, BAND))  # m below and above the terrain that is known so far


def terrain_of(run: Path | str, *, cell: float = 0.25, progress: Progress | None = None) -> Terrain:
    """Find the ground of a finished run, and its heights on a grid.

    Parameters
    ----------
    run : folder that `map`, `merge` or `localize` has written
    cell : m, edge of a cell

    Returns
    -------
    In the coordinates of the map's file.

    Raises
    ------
    UsageError
        If the folder holds no complete run, or the cell cannot be used.
    InputError
        If there is no map, or no ground in it.
    """
    source = open_map_of(run)
    return _moved(find_terrain(source, cell, progress or Progress()), source)


def write_terrain(
    run: Path | str,
    out: Path | str,
    *,
    cell: float = 0.25,
    interval: float = 0.5,
    scale: int | None = None,
    progress: Progress | None = None,
) -> Terrain:
    """Find the ground of a finished run, and write it.

    Parameters
    ----------
    run, cell : see `terrain_of`
    out : file to write: .tif for heights as GeoTIFF; .laz or .las for the map with LAS classes, 2 for
        ground and 1 for all else, and the height above ground; .geojson, .dxf, .svg, .png or .pdf for contours
    interval : m of height between two contours
    scale : of a drawing, 50 for 1:50; default: the largest round one that fits on A3

    Raises
    ------
    UsageError, InputError
        As `terrain_of`; also where the file cannot be written.
    """
    source, path = open_map_of(run), Path(out)
    require_new(path, (*_RASTER, *_CLOUDS, *_LINES))
    kind, progress = path.suffix.lower(), progress or Progress()
    if kind in _LINES:
        require_contourpy()
        if not 0 < interval < np.inf:
            msg = f"--interval {interval} cannot be used; give a height in metres above 0"
            raise UsageError(msg)
    if kind == ".dxf":
        require_ezdxf()
    local = find_terrain(source, cell, progress)
    found = _moved(local, source)
    with progress.stage("writing"):
        if kind in _RASTER:
            top = found.origin[1] + found.heights.shape[0] * cell
            heights = np.asarray(found.heights[::-1], np.float32)
            write_raster(path, heights, (cell, float(found.origin[0]), float(top)), source.epsg)
        elif kind in _CLOUDS:
            write_classified(source, local, path)
        else:
            write_contours(path, found, source, interval=interval, scale=scale)
    return found


def find_terrain(source: FinishedMap, cell: float, progress: Progress) -> Terrain:
    """Find the ground of a map, in coordinates relative to its origin; see `terrain_of`."""
    require_cell(cell)
    with progress.stage("finding the ground"):
        coarse = _coarse(source)
    with progress.stage("measuring the ground"):
        found = measured_surface(source, coarse, cell, _BANDS)
    if not found.measured.any():
        msg = f"{source.path}: no ground is found in it; give a map of a site whose ground was seen"
        raise InputError(msg)
    return found


def _coarse(source: FinishedMap) -> Terrain:
    """Return a first guess of the terrain, from the lowest surfaces of columns."""
    lowest = lowest_terrain(source)
    ground = ground_cells(lowest.heights, EDGE)
    filled = carried_on(np.where(ground, lowest.heights, np.nan), EDGE)
    return replace(lowest, heights=filled, measured=ground)


def _moved(terrain: Terrain, source: FinishedMap) -> Terrain:
    return replace(terrain, origin=terrain.origin + source.origin[:2])
