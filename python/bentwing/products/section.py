# SPDX-License-Identifier: MIT OR Apache-2.0
"""Sections of a finished run: as a value, and as a drawing at a round scale."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from bentwing.base.errors import UsageError
from bentwing.base.new_file import require_new
from bentwing.base.progress import Progress
from bentwing.products.cutting import cut_section
from bentwing.products.finished_map import open_map_of
from bentwing.products.section_drawing import DRAWINGS, draw, write_sheet
from bentwing.products.sheet_dxf import require_ezdxf

if TYPE_CHECKING:
    from bentwing.products.cutting import Section
    from bentwing.products.plane import CutPlane


def section_of(
    run: Path | str,
    plane: CutPlane | float = 1.0,
    *,
    thickness: float = 0.1,
    progress: Progress | None = None,
) -> Section:
    """Cut the map of a finished run.

    Parameters
    ----------
    run : folder that `map`, `merge` or `localize` has written
    plane : in the coordinates of the map's file; a number is the height, m, of a plan above the floor
        below the sensor
    thickness : m; points within half of it on both sides of the plane are taken

    Raises
    ------
    UsageError
        If the folder holds no complete run, or a number cannot be used.
    InputError
        If there is no map, or no point of it lies in the slab.
    """
    return cut_section(open_map_of(run), plane, thickness, progress or Progress())


def write_section(
    run: Path | str,
    out: Path | str,
    plane: CutPlane | float = 1.0,
    *,
    thickness: float = 0.1,
    scale: int | None = None,
    progress: Progress | None = None,
) -> tuple[Section, str]:
    """Cut the map of a finished run, and draw the section; return it and the scale with the paper.

    Parameters
    ----------
    run, plane, thickness : see `section_of`
    out : file to write, .dxf, .svg, .png or .pdf
    scale : 50 for 1:50; default: the largest round scale that fits on A3

    Raises
    ------
    UsageError, InputError
        As `section_of`; also where the file cannot be written or the drawing is too large for A0.
    """
    source, path = open_map_of(run), Path(out)
    require_new(path, DRAWINGS)
    if path.suffix.lower() == ".dxf":
        require_ezdxf()
    if scale is not None and scale < 1:
        msg = f"--scale {scale} cannot be used; give 50 for 1:50"
        raise UsageError(msg)
    found = cut_section(source, plane, thickness, progress or Progress())
    with (progress or Progress()).stage("drawing"):
        sheet = draw(found, source, scale)
        write_sheet(path, sheet)
    return found, f"1:{sheet.scale} on {sheet.paper}"
