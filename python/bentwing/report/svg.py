# SPDX-License-Identifier: MIT OR Apache-2.0
"""Annotated map views as inline SVG, and the strokes all drawings share."""

from __future__ import annotations

import base64
import math
import re
from html import escape
from typing import TYPE_CHECKING

from bentwing.report.colours import gradient
from bentwing.report.picture import encode_png
from bentwing.report.way import draw_way

if TYPE_CHECKING:
    from bentwing.report.picture import View
    from bentwing.report.way import Way

INK, FAINT, GRID = "#3c4653", "#6b7684", "#e4e8ed"
_VIEW_BOX = re.compile(r'viewBox="0 0 (\d+) (\d+)"')


def map_view(
    view: View,
    value_label: str,
    table: tuple[str, ...],
    *,
    way: Way | None = None,
    name: str = "map",
    text_size: int = 20,
    ends: tuple[str, str] | None = None,
) -> str:
    """Picture of a map with scale bar, colour legend and, if given, the carrier's way.

    Parameters
    ----------
    view : the picture
    value_label : what the colour shows, with unit
    table : its colour map
    way : of the carrier
    name : says what is seen, for those who cannot see it
    text_size : pixels of the picture
    ends : what stands at the ends of the legend; default: the values there
    """
    height, width, _ = view.image.shape
    wide = max(width, least_width(text_size))
    full = height + 24 + 2 * text_size
    data = base64.b64encode(encode_png(view.image)).decode("ascii")
    parts = [
        open_svg(wide, full, name),
        f'<image width="{width}" height="{height}" href="data:image/png;base64,{data}"/>',
    ]
    if way is not None:
        parts.append(draw_way(view, way))
    parts += scale_bar(view, height + 24.0, text_size)
    parts += legend(view, value_label, table, (float(wide), height + 14.0), text_size, ends)
    return "".join([*parts, "</svg>"])


def least_width(text_size: int) -> int:
    """Return the pixels that scale bar and legend need beside each other."""
    return 32 * text_size


def nice_ticks(low: float, high: float, n: int) -> list[float]:
    """About `n` round numbers that span `low` to `high` or lie inside it."""
    span = max(high - low, 1e-9 * max(abs(high), 1.0))
    raw = span / n
    magnitude = 10.0 ** math.floor(math.log10(raw))
    step = next(m * magnitude for m in (1, 2, 5, 10) if m * magnitude >= raw * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [i * step for i in range(first, last + 1)] or [low]


def scale_bar(view: View, y: float, text_size: int) -> list[str]:
    """Draw a bar of a round length, at most a quarter of the picture."""
    width = view.image.shape[1]
    longest = width * view.pixel / 4
    magnitude = 10.0 ** math.floor(math.log10(longest))
    metres = max(m * magnitude for m in (1, 2, 5) if m * magnitude <= longest)
    pixels = metres / view.pixel
    return [
        f'<path d="M4 {y - 7}V{y}H{4 + pixels:.1f}V{y - 7}" fill="none" stroke="{INK}" stroke-width="2.5"/>',
        text(4, y + 6 + text_size, f"{number(metres)} m", "start", INK, text_size),
    ]


def legend(  # noqa: PLR0917 - what, where and how large
    view: View,
    label: str,
    table: tuple[str, ...],
    corner: tuple[float, float],
    text_size: int,
    ends: tuple[str, str] | None = None,
) -> list[str]:
    """Draw what the colours mean, with its upper right at a corner."""
    if len(set(table)) == 1:
        return []  # one colour shows nothing but the light
    right, y = corner
    identity = f"g{table[0]}"
    stops = "".join(gradient(table))
    bar = 14 * text_size + 10
    low, high = ends or (f"{round(v, 1) + 0.0:.1f}" for v in (view.low, view.high))
    return [
        f'<defs><linearGradient id="{identity}">{stops}</linearGradient></defs>',
        f'<rect x="{right - bar - 4}" y="{y}" width="{bar}" height="10" rx="2" fill="url(#{identity})"/>',
        text(right - bar - 4, y + 16 + text_size, low, "start", INK, text_size),
        text(right - 4, y + 16 + text_size, high, "end", INK, text_size),
        text(right - bar - 14, y + 11, label, "end", FAINT, text_size),
    ]


def open_svg(width: int, height: int, name: str) -> str:
    """Open an SVG element that scales to its place; `name` says what is seen."""
    return (
        f'<svg viewBox="0 0 {width} {height}" role="img" aria-label="{escape(name, quote=True)}" '
        'xmlns="http://www.w3.org/2000/svg">'
    )


def standalone(drawing: str, unit: str = "") -> str:
    """Make a drawing a file of its own: with its size in a unit, a font, and paper below."""
    size = _VIEW_BOX.search(drawing)
    if size is None:
        msg = "drawing: expected an SVG with a view box"
        raise ValueError(msg)
    width, height = size.groups()
    opening, rest = drawing.split(">", 1)
    return (
        f'{opening} width="{width}{unit}" height="{height}{unit}"><style>text{{font-family:system-ui,'
        'sans-serif}</style><rect width="100%" height="100%" fill="#fff"/>'
        f"{rest}\n"
    )


def text(  # noqa: PLR0917 - position, content and style
    x: float, y: float, content: str, anchor: str, ink: str = FAINT, size: float = 12
) -> str:
    """Draw a text; `anchor` is start, middle or end."""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{ink}" font-size="{size:g}">'
        f"{escape(content)}</text>"
    )


def number(value: float) -> str:
    """Write a number as a person would."""
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.6g}"
