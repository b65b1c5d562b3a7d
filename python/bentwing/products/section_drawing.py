# SPDX-License-Identifier: MIT OR Apache-2.0
"""A section on paper: points, walls, grid and title."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.atomic import write_bytes, write_text
from bentwing.products.plane import CELL
from bentwing.products.sheet import INK, Sheet, Stroke, add_grid, lay_out
from bentwing.products.sheet_dxf import write_dxf
from bentwing.products.sheet_svg import POINT_INK, sheet_picture, sheet_svg
from bentwing.products.title import Entry, add_title, made_of, place_of
from bentwing.report.picture import extent

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.products.cutting import Section
    from bentwing.products.finished_map import FinishedMap

    Array = NDArray[np.float64]

DRAWINGS = (".dxf", ".svg", ".png", ".pdf")
"""Endings of files that a sheet becomes."""
_BESIDE = 0.05  # m around the walls


def draw(found: Section, source: FinishedMap, scale: int | None) -> Sheet:
    """Draw a section on paper; see `write_section`."""
    low, high = _frame(found)
    sheet = lay_out(low, high, scale)
    add_grid(sheet)
    inside = sheet.inside(found.points)
    sheet.places, sheet.counts = found.points[inside], found.counts[inside]
    for line in found.lines:
        sheet.strokes.append(Stroke("WALLS", sheet.on_paper(line), 0.35))
    title, lines = described(found, source)
    legend = [Entry("POINTS", POINT_INK, 0.0, "points")]
    if len(found.lines):
        legend.append(Entry("WALLS", INK, 0.35, f"{_noun(found)}, fitted"))
    up = None
    if found.plane.is_level:
        up = "y" if source.epsg is None else "N"
    add_title(sheet, title, lines, legend, up)
    return sheet


def _frame(found: Section) -> tuple[Array, Array]:
    """Return the corners (2,) m of what is drawn: all walls, and all points but the few far ones."""
    if not len(found.lines):
        ends = np.array([extent(axis) for axis in found.points.T])
        return ends[:, 0], ends[:, 1]
    corners = found.lines.reshape(-1, 2)
    usual = np.percentile(found.points, [1, 99], axis=0)
    return (
        np.minimum(corners.min(axis=0) - _BESIDE, usual[0]),
        np.maximum(corners.max(axis=0) + _BESIDE, usual[1]),
    )


def _noun(found: Section) -> str:
    return "walls" if found.plane.is_level else "surfaces"


def described(found: Section, source: FinishedMap) -> tuple[str, list[str]]:
    """Return the title of a section, and sentences about it."""
    half = found.thickness / 2
    origin = found.plane.origin
    if found.plane.is_level:
        height = float(origin[2])
        above = "" if found.floor is None else f"; floor at {found.floor:.2f} m"
        title = f"Plan at height {height:.2f} m"
        if found.floor is not None:
            title = f"Plan {height - found.floor:.2f} m above the floor"
        slab = f"Heights from {height - half:.2f} to {height + half:.2f} m{above}"
    elif np.isfinite(found.plane.length):
        x, y = found.plane.points_at(np.array([[found.plane.length, 0.0]]))[0, :2]
        title = f"Section ({origin[0]:.10g}, {origin[1]:.10g}) to ({x:.10g}, {y:.10g})"
        slab = f"Slab of {found.thickness:g} m; distance from the first point, height"
    else:
        normal = np.cross(found.plane.across, found.plane.up)
        title = f"Section through ({', '.join(f'{v:.10g}' for v in origin)})"
        slab = (
            f"Slab of {found.thickness:g} m; seen against ({', '.join(f'{v:.3g}' for v in normal)})"
        )
    length = np.linalg.norm(found.lines[:, 1] - found.lines[:, 0], axis=1).sum()
    apart = f"{1000 * found.spacing:.0f} mm" if found.spacing < 1 else f"{found.spacing:.1f} m"
    points = f"{found.counts.sum():,} points; ground sample distance {apart}"
    walls = f"{len(found.lines)} {_noun(found)}, {length:.1f} m; " if len(found.lines) else ""
    return title, [slab, points, walls + place_of(source), made_of(source)]


def write_sheet(path: Path, sheet: Sheet) -> None:
    """Write a drawing in the format that the name of the file says."""
    kind = path.suffix.lower()
    if kind == ".dxf":
        write_dxf(path, sheet)
    elif kind == ".svg":
        write_text(path, sheet_svg(sheet, CELL))
    else:
        write_bytes(path, sheet_picture(sheet, CELL, kind[1:].upper()))
