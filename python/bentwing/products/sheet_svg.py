# SPDX-License-Identifier: MIT OR Apache-2.0
"""A sheet as SVG, PNG and PDF, true to scale when it is printed at its size."""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.picture import encode_png
from bentwing.report.raster import rasterize_paper
from bentwing.report.svg import open_svg, standalone, text

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.products.sheet import Letters, Sheet, Stroke

_PIXEL = 0.1  # mm, of the measured points
_SMALLEST = 2  # pixels of a point
_LIGHT, _DARK = np.array([140.0, 158.0, 184.0]), np.array([58.0, 84.0, 130.0])
POINT_INK = "#7f93b4"
"""Of points in a legend."""
_MANY = 30.0  # points in a cell that are drawn darkest


def sheet_svg(sheet: Sheet, cell: float) -> str:
    """Return a sheet as an SVG file, mm wide and high.

    Parameters
    ----------
    cell : m, edge of the square that stands for each of the measured places
    """
    width, height = sheet.size
    parts = [open_svg(width, height, "Section of a map"), _points(sheet, cell)]
    parts += [_stroke(stroke, height) for stroke in sheet.strokes]
    parts += [_letters(letters, height) for letters in sheet.letters]
    return standalone("".join([*parts, "</svg>"]), unit="mm")


def sheet_picture(sheet: Sheet, cell: float, kind: str) -> bytes:
    """Return a sheet as a PNG or PDF file of one picture."""
    return rasterize_paper(sheet_svg(sheet, cell), kind)


def _stroke(stroke: Stroke, height: int) -> str:
    places = " ".join(f"{x:.2f},{height - y:.2f}" for x, y in stroke.points.tolist())
    return (
        f'<polyline points="{places}" fill="none" stroke="{stroke.ink}" '
        f'stroke-width="{stroke.width:g}" stroke-linejoin="round"/>'
    )


def _letters(letters: Letters, height: int) -> str:
    x, y = letters.at
    # letters are as high as their capitals, a font is half as high again
    return text(x, height - y, letters.content, letters.anchor, letters.ink, 1.4 * letters.height)


def _points(sheet: Sheet, cell: float) -> str:
    left, lower, right, upper = sheet.area
    image = _image(sheet, max(round(1000 * cell / sheet.scale / _PIXEL), _SMALLEST))
    data = base64.b64encode(encode_png(image)).decode("ascii")
    place = f'x="{left:g}" y="{sheet.size[1] - upper:g}" width="{right - left:g}" height="{upper - lower:g}"'
    return f'<image {place} href="data:image/png;base64,{data}"/>'


def _image(sheet: Sheet, size: int) -> NDArray[np.uint8]:
    """Draw a square of `size` pixels for each place, the darker the more points."""
    left, lower, right, upper = sheet.area
    shape = round((upper - lower) / _PIXEL), round((right - left) / _PIXEL)
    inside = sheet.inside(sheet.places)
    mm = sheet.on_paper(sheet.places[inside])
    shade = np.clip(np.log1p(sheet.counts[inside]) / np.log1p(_MANY), 0, 1)
    order = np.argsort(shade, kind="stable")  # the dark ones are drawn last
    row = np.floor((upper - mm[order, 1]) / _PIXEL).astype(np.intp) - size // 2
    column = np.floor((mm[order, 0] - left) / _PIXEL).astype(np.intp) - size // 2
    ink = (_LIGHT + shade[order, None] * (_DARK - _LIGHT)).astype(np.uint8)
    image = np.full((*shape, 3), 255, np.uint8)
    for down in range(size):
        for right_by in range(size):
            r, c = np.clip(row + down, 0, shape[0] - 1), np.clip(column + right_by, 0, shape[1] - 1)
            image[r, c] = ink
    return image
