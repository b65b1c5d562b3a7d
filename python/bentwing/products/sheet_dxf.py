# SPDX-License-Identifier: MIT OR Apache-2.0
"""A sheet as DXF: the model in metres, and a layout that shows it on paper at its scale."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.atomic import atomic_path
from bentwing.base.errors import UsageError
from bentwing.products.plane import Slab

if TYPE_CHECKING:
    from pathlib import Path

    from bentwing.products.sheet import Sheet

# Colour of the AutoCAD index, and width of lines in hundredths of a millimetre.
_LAYERS = {
    "POINTS": (8, 13),
    "WALLS": (7, 35),
    "CONTOURS": (34, 18),
    "GRID": (9, 9),
    "TITLE": (7, 25),
}
_MOST_POINTS = 100_000  # more make a file that no program opens quickly
_ANCHORS = {"start": "LEFT", "middle": "CENTER", "end": "RIGHT"}


def write_dxf(path: Path, sheet: Sheet) -> None:
    """Write a sheet, atomically.

    Raises
    ------
    UsageError
        If ezdxf is not installed.
    """
    ezdxf = require_ezdxf()
    document = ezdxf.new("R2010", setup=True)
    document.units = ezdxf.units.M
    document.header["$MEASUREMENT"] = 1
    for name, (colour, width) in _LAYERS.items():
        document.layers.add(name, color=colour, lineweight=width)
    _draw(ezdxf, document.modelspace(), sheet)
    _lay_out(document, sheet)
    with atomic_path(path) as temporary:
        document.saveas(temporary)


def require_ezdxf() -> Any:  # noqa: ANN401 - imported when needed
    """Import ezdxf.

    Raises
    ------
    UsageError
        If it is not installed.
    """
    try:
        return import_module("ezdxf")
    except ImportError:
        msg = "DXF drawings need the package ezdxf, which is not installed; run `pip install bentwing[products]`"
        raise UsageError(msg) from None


def _draw(ezdxf: Any, model: Any, sheet: Sheet) -> None:  # noqa: ANN401
    metre = sheet.scale / 1000  # of a mm on paper
    few = Slab(sheet.places - sheet.corner, sheet.counts).at_most(_MOST_POINTS)
    for place in (few.places + sheet.corner).tolist():
        model.add_point(place, dxfattribs={"layer": "POINTS"})
    for stroke in sheet.strokes:
        places = (stroke.points * metre + sheet.corner).tolist()
        attributes = {"layer": stroke.layer, "lineweight": _line_width(stroke.width)}
        if stroke.level is not None:
            model.add_lwpolyline(places, dxfattribs={**attributes, "elevation": stroke.level})
        elif len(places) == 2:
            model.add_line(*places, dxfattribs=attributes)
        else:
            model.add_lwpolyline(places, dxfattribs=attributes)
    for letters in sheet.letters:
        at = (np.array(letters.at) * metre + sheet.corner).tolist()
        align = ezdxf.enums.TextEntityAlignment[_ANCHORS[letters.anchor]]
        written = model.add_text(
            letters.content, height=letters.height * metre, dxfattribs={"layer": letters.layer}
        )
        written.set_placement(at, align=align)


def _line_width(mm: float) -> int:
    """Return the nearest of the widths that the format knows, in hundredths of a millimetre."""
    return min((0, 5, 9, 13, 18, 25, 35, 50, 70, 100, 120, 140), key=lambda w: abs(w - 100 * mm))


def _lay_out(document: Any, sheet: Sheet) -> None:  # noqa: ANN401
    width, height = sheet.size
    document.layouts.rename("Layout1", f"{sheet.paper} 1-{sheet.scale}")
    paper = document.layout(f"{sheet.paper} 1-{sheet.scale}")
    paper.page_setup(size=(width, height), margins=(0, 0, 0, 0), units="mm", scale=(1, 1))
    middle = sheet.corner + np.array([width, height]) / 2 * sheet.scale / 1000
    paper.add_viewport(
        center=(width / 2, height / 2),
        size=(width, height),
        view_center_point=tuple(middle.tolist()),
        view_height=height * sheet.scale / 1000,
        status=2,
    )
