# SPDX-License-Identifier: MIT OR Apache-2.0
"""The plan of a site: the map from above with a grid of coordinates, scale bar, north, way and marks."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, TypeAlias

from bentwing.report.colours import HEIGHT
from bentwing.report.lettering import multiples
from bentwing.report.picture import encode_png
from bentwing.report.svg import (
    FAINT,
    INK,
    least_width,
    legend,
    nice_ticks,
    open_svg,
    scale_bar,
    text,
)
from bentwing.report.texts import ENGLISH
from bentwing.report.way import draw_way

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from bentwing.report.frame import ShownFrame
    from bentwing.report.picture import View
    from bentwing.report.texts import Texts
    from bentwing.report.way import Way

_LEFT, _FOOT, _TOP, _SIZE = 38, 100, 30, 22  # pixels: margins, and the height of letters
_LINES = 6  # of the grid, about, along the longer side
_MARK = 8  # pixels, half of a mark's size

Box: TypeAlias = "tuple[float, float, float, float]"


@dataclass(frozen=True, slots=True)
class Mark:
    """A surveyed point.

    Attributes
    ----------
    name : of it
    place : (2,) m, shown coordinates
    is_check : whether it only measures the map; None for a name without a symbol
    """

    name: str
    place: tuple[float, float]
    is_check: bool | None


def draw_plan(
    view: View,
    frame: ShownFrame,
    *,
    way: Way,
    marks: Sequence[Mark] = (),
    table: tuple[str, ...] = HEIGHT,
    key: Sequence[tuple[str, str]] = (),
    name: str | None = None,
    texts: Texts = ENGLISH,
) -> str:
    """Draw a plan as SVG.

    Parameters
    ----------
    view : the picture, in coordinates of the frame
    frame : which has the origin of the grid, and says whether north is up
    way : of the sensor
    marks : surveyed points
    table : colour map of the heights
    key : colours of other things, and what these are
    name : says what is seen, for those who cannot see it
    texts : words of the language
    """
    ends = (texts.number(v, ".1f") for v in (round(view.low, 1) + 0.0, round(view.high, 1) + 0.0))
    height, width, _ = view.image.shape
    data = base64.b64encode(encode_png(view.image)).decode("ascii")
    wide = max(width, least_width(_SIZE))
    foot = height + 32.0 + _SIZE
    parts = [
        open_svg(wide + _LEFT, height + _TOP + _FOOT, name or texts.plan),
        f'<g transform="translate({_LEFT} {_TOP})">',
        f'<image width="{width}" height="{height}" href="data:image/png;base64,{data}"/>',
        f'<rect width="{width}" height="{height}" fill="none" stroke="{FAINT}"/>',
        *_grid(view, frame.origin, texts),
        draw_way(view, way),
        *_marked(marks, view),
        *scale_bar(view, foot, _SIZE),
        *legend(
            view,
            texts.height_legend,
            table,
            (float(wide), foot - 10.0),
            _SIZE,
            (next(ends), next(ends)),
        ),
        *_key(key, float(wide), foot),
    ]
    if frame.is_north_up:
        parts.append(_north(width - 40.0, 14.0))
    return "".join([*parts, "</g></svg>"])


def _grid(view: View, origin: NDArray[np.float64], texts: Texts) -> list[str]:
    """Lines at round coordinates, with these at the left and below."""
    height, width, _ = view.image.shape
    left, top, pixel = view.left + origin[0], view.top + origin[1], view.pixel
    right, bottom = left + width * pixel, top - height * pixel
    ticks = nice_ticks(0.0, max(right - left, top - bottom), _LINES)
    step = ticks[1] - ticks[0] if len(ticks) > 1 else 1.0
    parts = []
    for x in multiples(left, right, step):
        at = (x - left) / pixel
        parts.append(_line(f"M{at:.1f} 0V{height}"))
        if 30 < at < width - 30:
            parts.append(text(at, height + 5 + _SIZE, _coordinate(x, texts), "middle", INK, _SIZE))
    for y in multiples(bottom, top, step):
        at = (top - y) / pixel
        parts.append(_line(f"M0 {at:.1f}H{width}"))
        if 30 < at < height - 30:
            turned = f'transform="rotate(-90 -10 {at:.1f})"'
            parts.append(
                f'<text x="-10" y="{at:.1f}" {turned} text-anchor="middle" fill="{INK}" '
                f'font-size="{_SIZE}">{_coordinate(y, texts)}</text>'
            )
    return parts


def _coordinate(value: float, texts: Texts) -> str:
    """Write a coordinate of a grid: whole metres without a fraction."""
    return texts.number(value + 0.0, ",.0f" if abs(value) >= 10 else "g")


def _key(key: Sequence[tuple[str, str]], right: float, y: float) -> list[str]:
    """Draw what colours mean, from the right."""
    parts = []
    for colour, meaning in reversed(key):
        parts.append(text(right, y + 6, meaning, "end", INK, _SIZE))
        right -= 0.58 * _SIZE * len(meaning) + 24
        parts.append(f'<rect x="{right:.0f}" y="{y - 9}" width="15" height="15" fill="#{colour}"/>')
        right -= 22
    return parts


def _line(path: str) -> str:
    return f'<path d="{path}" fill="none" stroke="#000" stroke-opacity=".28" stroke-width=".8"/>'


def _north(x: float, y: float) -> str:
    return (
        f'<g transform="translate({x} {y})"><rect x="-8" y="-8" width="40" height="60" rx="6" fill="#fff" fill-opacity=".85"/>'
        f'<path d="M12 6L22 46L12 38L2 46Z" fill="{INK}"/>'
        f"{text(12, 3 + _SIZE / 4, 'N', 'middle', INK, _SIZE)}</g>"
    )


def _marked(marks: Sequence[Mark], view: View) -> list[str]:
    """Draw marks, and their names where these do not lie on each other."""
    places = [
        ((m.place[0] - view.left) / view.pixel, (view.top - m.place[1]) / view.pixel) for m in marks
    ]
    taken = [(x - _MARK, y - _MARK, x + _MARK, y + _MARK) for x, y in places]
    drawn = [_symbol(x, y, mark.is_check) for mark, (x, y) in zip(marks, places, strict=True)]
    for mark, (x, y) in zip(marks, places, strict=True):
        long = 0.66 * _SIZE * len(mark.name)
        corners = [(x + _MARK + 4, y + 6), (x - _MARK - 4 - long, y + 6),
                   (x - long / 2, y - _MARK - 5), (x - long / 2, y + _MARK + _SIZE)]  # fmt: skip
        for left, base in corners:
            box = (left - 2, base - _SIZE, left + long + 2, base + 5)
            if not any(_overlap(box, other) for other in taken):
                taken.append(box)
                drawn.append(
                    f'<text x="{left:.1f}" y="{base:.1f}" font-size="{_SIZE}" fill="#000" stroke="#fff" '
                    f'stroke-width="4" paint-order="stroke">{escape(mark.name)}</text>'
                )
                break
    return drawn


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _symbol(x: float, y: float, is_check: bool | None) -> str:  # noqa: FBT001 - it is what is drawn
    if is_check is None:
        return ""
    r = _MARK
    shape = f"M{-r} {-r}H{r}V{r}H{-r}Z" if is_check else f"M0 {-r - 2}L{r + 1} {r}H{-r - 1}Z"
    return (
        f'<path transform="translate({x:.1f} {y:.1f})" d="{shape}" fill="#fff" stroke="#000" '
        'stroke-width="2.5"/>'
    )
