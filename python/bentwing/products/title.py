# SPDX-License-Identifier: MIT OR Apache-2.0
"""The title block of a drawing: what is shown, scale, north and legend."""

from __future__ import annotations

from datetime import datetime, timezone
from typing import TYPE_CHECKING, NamedTuple

from bentwing.base.clock import NS_PER_S
from bentwing.base.provenance import bentwing_version
from bentwing.products.sheet import FAINT, FOOT, INK, MARGIN, add_box

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.products.finished_map import FinishedMap
    from bentwing.products.sheet import Layer, Sheet

_BAR = 40.0  # mm, the longest scale bar
_LEGEND = 36.0  # mm, its width
_SCALE = 64.0


class Entry(NamedTuple):
    """A line of the legend: how it is drawn and what it is; a width of zero stands for points."""

    layer: Layer
    ink: str
    width: float
    meaning: str


def add_title(
    sheet: Sheet, title: str, lines: Sequence[str], legend: Sequence[Entry], up: str | None
) -> None:
    """Draw the title block below the drawing.

    Parameters
    ----------
    title : what is shown
    lines : at most four sentences about it
    legend : at most four entries
    up : name of what points up on the paper; None draws no arrow
    """
    width = sheet.size[0]
    top = MARGIN + FOOT
    add_box(sheet, "TITLE", (MARGIN, MARGIN, width - MARGIN, top), 0.35)
    at_legend = width - MARGIN - _SCALE - _LEGEND
    at_scale = width - MARGIN - _SCALE
    for x in (at_legend, at_scale):
        sheet.stroke("TITLE", [(x, MARGIN), (x, top)], 0.25)
    left = MARGIN + 3.0
    room = at_legend - left - 2.0
    sheet.write((left, top - 7.0), _cut(title, room, 4.0), 4.0)
    for row, line in enumerate(lines):
        sheet.write((left, top - 13.0 - 4.6 * row), _cut(line, room, 2.4), 2.4, ink=FAINT)
    _add_legend(sheet, (at_legend + 3.0, top - 5.5), legend)
    _add_scale(sheet, (at_scale + 4.0, top))
    if up is not None:
        _add_arrow(sheet, (width - MARGIN - 9.0, top - 5.0), up)


def place_of(source: FinishedMap) -> str:
    """Say in which coordinates a map is."""
    if source.epsg is not None:
        return f"m in EPSG:{source.epsg}"
    has_marks = bool((source.run.record.get("georeference") or {}).get("mode"))
    return "m in the frame of the control points" if has_marks else "m in the run's own frame"


def made_of(source: FinishedMap) -> str:
    """Say of which run a drawing is, recorded when, and made by what."""
    day = datetime.fromtimestamp(source.run.start_ns // NS_PER_S, timezone.utc).date()
    name = source.run.folder.resolve().name
    return f"{name}, recorded {day}; bentwing {bentwing_version()}"


def _cut(text: str, room: float, height: float) -> str:
    """Shorten a text to a width, mm; letters are about 0.7 times as wide as capitals are high."""
    most = int(room / (0.72 * height))
    return text if len(text) <= most else text[: most - 3].rstrip() + "..."


def _add_legend(sheet: Sheet, corner: tuple[float, float], legend: Sequence[Entry]) -> None:
    x, y = corner
    for row, entry in enumerate(legend):
        middle = y - 6.0 * row
        if entry.width:
            sheet.stroke("TITLE", [(x, middle), (x + 8.0, middle)], entry.width, entry.ink)
        else:
            for step in range(5):
                at = x + 1.9 * step
                sheet.stroke("TITLE", [(at, middle), (at + 0.4, middle)], 0.4, entry.ink)
        sheet.write((x + 11.0, middle - 0.9), entry.meaning, 2.4)


def _add_scale(sheet: Sheet, corner: tuple[float, float]) -> None:
    """Write the scale, and draw a bar of a round length."""
    x, top = corner
    sheet.write((x, top - 9.0), f"1:{sheet.scale}", 6.0)
    width, height = sheet.size
    sheet.write((x, top - 14.0), f"{sheet.paper}, {width} x {height} mm", 2.2, ink=FAINT)
    longest = _BAR * sheet.scale / 1000
    magnitude = 10.0 ** int(f"{longest:e}".split("e")[1])
    metres = max(m * magnitude for m in (1, 2, 5) if m * magnitude <= longest)
    length = 1000 * metres / sheet.scale
    y = top - 23.0
    for part in range(4):
        start, end = x + length * part / 4, x + length * (part + 1) / 4
        level = y + (0.6 if part % 2 else -0.6)
        sheet.stroke("TITLE", [(start, level), (end, level)], 1.2, INK if part % 2 else FAINT)
    for share in (0.0, 1.0):
        name = f"{share * metres:g} m" if share else "0"
        sheet.write((x + share * length, y - 5.0), name, 2.4, "middle" if share else "start")


def _add_arrow(sheet: Sheet, top: tuple[float, float], name: str) -> None:
    x, y = top
    sheet.stroke("TITLE", [(x, y), (x, y - 18.0)], 0.35)
    sheet.stroke("TITLE", [(x - 1.8, y - 5.0), (x, y), (x + 1.8, y - 5.0)], 0.35)
    sheet.write((x, y - 22.5), name, 3.5, "middle")
