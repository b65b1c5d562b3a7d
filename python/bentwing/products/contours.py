# SPDX-License-Identifier: MIT OR Apache-2.0
"""Contour lines of a terrain: as lines, as GeoJSON and as a drawing."""

from __future__ import annotations

import json
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bentwing.base.atomic import write_text
from bentwing.base.errors import InputError, UsageError
from bentwing.map.epsg import geojson_system
from bentwing.products.section_drawing import write_sheet
from bentwing.products.sheet import Stroke, add_grid, lay_out
from bentwing.products.title import Entry, add_title, made_of, place_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.products.finished_map import FinishedMap
    from bentwing.products.ground import Terrain

_INK = "#9a6a3a"
_INDEX = 5  # every fifth is bold and has its height
_LONG_ENOUGH = 30.0  # mm on paper, for a number on it


class Contour(NamedTuple):
    """A line of one height, m, through points (N, 2) m; closed if the last is the first."""

    level: float
    points: NDArray[np.float64]


def require_contourpy() -> Any:  # noqa: ANN401 - imported when needed
    """Import contourpy.

    Raises
    ------
    UsageError
        If it is not installed.
    """
    try:
        return import_module("contourpy")
    except ImportError:
        msg = "contours need the package contourpy, which is not installed; run `pip install bentwing[products]`"
        raise UsageError(msg) from None


def contour_lines(terrain: Terrain, interval: float) -> list[Contour]:
    """Return the contours of a terrain at multiples of an interval, m, lowest first.

    Raises
    ------
    UsageError
        If contourpy is not installed.
    """
    contourpy = require_contourpy()
    heights = np.ma.masked_invalid(terrain.heights)
    if heights.count() == 0 or min(heights.shape) < 2:
        return []
    rows, columns = heights.shape
    generator = contourpy.contour_generator(
        terrain.cell * (np.arange(columns) + 0.5), terrain.cell * (np.arange(rows) + 0.5), heights
    )
    first, last = np.ceil(heights.min() / interval), np.floor(heights.max() / interval)
    return [
        Contour(level, line + terrain.origin)
        for level in (interval * np.arange(first, last + 1)).tolist()
        for line in generator.lines(level)
    ]


def write_contours(
    path: Path,
    terrain: Terrain,
    source: FinishedMap,
    *,
    interval: float,
    scale: int | None,
) -> None:
    """Write the contours of a terrain as GeoJSON or as a drawing, by the name of the file.

    Raises
    ------
    InputError
        If there are none.
    """
    contours = contour_lines(terrain, interval)
    if not contours:
        low, high = np.nanmin(terrain.heights), np.nanmax(terrain.heights)
        msg = f"{source.path}: no contour crosses the ground, from {low:.2f} to {high:.2f} m; give a smaller --interval"
        raise InputError(msg)
    if path.suffix.lower() == ".geojson":
        write_text(path, json.dumps(_geojson(contours, source.epsg), indent=0) + "\n")
        return
    ends = np.concatenate([contour.points for contour in contours])
    sheet = lay_out(ends.min(axis=0), ends.max(axis=0), scale)
    add_grid(sheet)
    levels = np.unique([contour.level for contour in contours])
    for contour in contours:
        is_index = round(contour.level / interval) % _INDEX == 0
        mm = sheet.on_paper(contour.points)
        width = 0.35 if is_index else 0.15
        sheet.strokes.append(Stroke("CONTOURS", mm, width, _INK, contour.level))
        length = np.linalg.norm(np.diff(mm, axis=0), axis=1).sum()
        if is_index and length > _LONG_ENOUGH:
            x, y = mm[len(mm) // 2].tolist()
            sheet.write((x + 0.6, y + 0.6), f"{contour.level:g}", 1.8, ink=_INK, layer="CONTOURS")
    lines = [
        f"Contours every {interval:g} m, from {levels[0]:g} to {levels[-1]:g} m",
        f"Ground on a grid of {terrain.cell:g} m",
        f"Coordinates {place_of(source)}",
        made_of(source),
    ]
    legend = [
        Entry("CONTOURS", _INK, 0.15, "contour"),
        Entry("CONTOURS", _INK, 0.35, "every fifth"),
    ]
    add_title(sheet, "Terrain", lines, legend, "y" if source.epsg is None else "N")
    write_sheet(path, sheet)


def _geojson(contours: Sequence[Contour], epsg: int | None) -> dict[str, Any]:
    """Return contours as GeoJSON in the coordinates of the map."""
    features = [
        {
            "type": "Feature",
            "properties": {"height": contour.level},
            "geometry": {"type": "LineString", "coordinates": contour.points.round(4).tolist()},
        }
        for contour in contours
    ]
    return {"type": "FeatureCollection", **geojson_system(epsg), "features": features}
