# SPDX-License-Identifier: MIT OR Apache-2.0
"""Annotated map views as inline SVG, and the strokes all drawings share."""

from __future__ import annotations

import base64
import math
import re
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.colours import gradient
from bentwing.report.picture import encode_png
from bentwing.report.way import draw_way

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.report.picture import View
    from bentwing.report.way import Way

INK, FAINT, GRID = "#3c4653", "#6b7684", "#e4e8ed"
_MOST_POINTS = 1200  # of a path
_JUMP = 1.0  # m from one drawn point to the next, beyond ten usual steps
_VIEW_BOX = re.compile(r'viewBox="0 0 (\d+) (\d+)"')


def map_view(
    view: View,
    value_label: str,
    table: tuple[str, ...],
    *,
    way: Way | None = None,
    name: str = "map",
    text_size: int = 20,
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
    """
    height, width, _ = view.image.shape
    full = height + 24 + 2 * text_size
    data = base64.b64encode(encode_png(view.image)).decode("ascii")
    parts = [
        open_svg(width, full, name),
        f'<image width="{width}" height="{height}" href="data:image/png;base64,{data}"/>',
    ]
    if way is not None:
        parts.append(draw_way(view, way))
    parts += _scale_bar(view, height + 24.0, text_size)
    parts += _legend(view, value_label, table, (float(width), height + 14.0), text_size)
    return "".join([*parts, "</svg>"])


def nice_ticks(low: float, high: float, n: int) -> list[float]:
    """About `n` round numbers that span `low` to `high` or lie inside it."""
    span = max(high - low, 1e-9 * max(abs(high), 1.0))
    raw = span / n
    magnitude = 10.0 ** math.floor(math.log10(raw))
    step = next(m * magnitude for m in (1, 2, 5, 10) if m * magnitude >= raw * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [i * step for i in range(first, last + 1)] or [low]


def _path(view: View, across: NDArray[np.float64], up: NDArray[np.float64]) -> str:
    every = max(len(across) // _MOST_POINTS, 1)
    x = (across[::every] - view.left) / view.pixel
    y = (view.top - up[::every]) / view.pixel
    # Between two runs, or over a break, nobody flew.
    steps = np.hypot(np.diff(x), np.diff(y)) * view.pixel
    usual = float(steps.mean()) if len(steps) else 0.0
    jumps = np.flatnonzero(steps > _JUMP + 10 * usual) + 1
    pieces = zip(np.split(x, jumps), np.split(y, jumps), strict=True)
    path = " ".join(_move(*piece) for piece in pieces)
    line = f'<path d="{path}" fill="none" stroke-linejoin="round" '
    start = f'<circle cx="{x[0]:.1f}" cy="{y[0]:.1f}" r="8" fill="#fff" stroke="#c8331e" stroke-width="4"/>'
    return (
        f'{line}stroke="#fff" stroke-width="7" stroke-opacity=".75"/>'
        f'{line}stroke="#c8331e" stroke-width="3.6"/>{start}'
    )


def _move(x: NDArray[np.float64], y: NDArray[np.float64]) -> str:
    return "M" + "L".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))


def _scale_bar(view: View, y: float, text_size: int) -> list[str]:
    width = view.image.shape[1]
    longest = width * view.pixel / 4
    magnitude = 10.0 ** math.floor(math.log10(longest))
    metres = max(m * magnitude for m in (1, 2, 5) if m * magnitude <= longest)
    pixels = metres / view.pixel
    return [
        f'<path d="M4 {y - 7}V{y}H{4 + pixels:.1f}V{y - 7}" fill="none" stroke="{INK}" stroke-width="2.5"/>',
        text(4, y + 6 + text_size, f"{number(metres)} m", "start", INK, text_size),
    ]


def _legend(
    view: View, label: str, table: tuple[str, ...], corner: tuple[float, float], text_size: int
) -> list[str]:
    if len(set(table)) == 1:
        return []  # one colour shows nothing but the light
    right, y = corner
    identity = f"g{table[0]}"
    stops = "".join(gradient(table))
    return [
        f'<defs><linearGradient id="{identity}">{stops}</linearGradient></defs>',
        f'<rect x="{right - 260}" y="{y}" width="256" height="10" rx="2" fill="url(#{identity})"/>',
        text(
            right - 260,
            y + 16 + text_size,
            f"{round(view.low, 1) + 0.0:.1f}",
            "start",
            INK,
            text_size,
        ),
        text(
            right - 4, y + 16 + text_size, f"{round(view.high, 1) + 0.0:.1f}", "end", INK, text_size
        ),
        text(right - 132, y + 16 + text_size, label, "middle", FAINT, text_size),
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
