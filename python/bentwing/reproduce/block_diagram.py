# SPDX-License-Identifier: MIT OR Apache-2.0
"""The block diagram of the spin controller, with the gains it has."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bentwing.report.svg import FAINT, INK, open_svg, text

if TYPE_CHECKING:
    from bentwing.flight.control import SpinSettings

_BOX = (130, 40)
_ROWS = (50, 130, 210)  # pixels, middle of the three terms
_TERMS, _SUM, _LIMIT, _OUT = 255, 390, 480, 640  # pixels, from left to right


def controller_diagram(settings: SpinSettings) -> str:
    """Draw Fig. 10 of Kaul 2015: map, proportional term and stall prevention, summed and limited."""
    low, high = math.degrees(settings.lowest_angle), math.degrees(settings.highest_angle)
    names = (
        ("map", f"k_m = {settings.map_gain:g} s"),
        ("proportional", f"k_p = {settings.proportional_gain:g} s"),
        (
            f"below {math.degrees(settings.stall_rate):.0f} °/s",
            f"k_sp = {math.degrees(settings.stall_angle):.0f}°",
        ),
    )
    parts = [open_svg(680, 270, "Block diagram of the spin controller")]
    for y, (name, gain) in zip(_ROWS, names, strict=True):
        parts += _box(_TERMS, y, name, gain)
        parts.append(_arrow(_TERMS + _BOX[0] / 2, y, _SUM, y))
    parts += [
        _line(_SUM, _ROWS[0], _SUM, _ROWS[2]),
        *_box(_LIMIT + 25, 130, "limit", f"{low:.0f}° … {high:.0f}°"),
    ]
    parts += [_arrow(_SUM, 130, _LIMIT - 40, 130), _arrow(_LIMIT + 90, 130, _OUT, 130)]
    parts += [text(_OUT + 4, 122, "vanes", "end", INK), text(_SUM + 6, 124, "Σ", "start", INK, 14)]
    parts += _inputs()
    return "".join([*parts, "</svg>"])


def _inputs() -> list[str]:
    left = _TERMS - _BOX[0] / 2
    return [
        text(8, _ROWS[0] - 8, "desired rate", "start", INK),
        _arrow(8, _ROWS[0], left, _ROWS[0]),
        _line(60, _ROWS[0], 60, _ROWS[1]),
        _arrow(60, _ROWS[1], 112, _ROWS[1]),
        f'<circle cx="122" cy="{_ROWS[1]}" r="10" fill="none" stroke="{INK}"/>',
        text(122, _ROWS[1] + 4, "\N{MINUS SIGN}", "middle", INK),
        _arrow(132, _ROWS[1], left, _ROWS[1]),
        text(8, _ROWS[2] - 8, "measured rate", "start", INK),
        _arrow(8, _ROWS[2], left, _ROWS[2]),
        _line(122, _ROWS[2], 122, _ROWS[1] + 22),
        _arrow(122, _ROWS[1] + 22, 122, _ROWS[1] + 11),
    ]


def _box(x: float, y: float, name: str, detail: str) -> list[str]:
    width, height = _BOX
    return [
        f'<rect x="{x - width / 2}" y="{y - height / 2}" width="{width}" height="{height}" rx="4" '
        f'fill="#fff" stroke="{INK}"/>',
        text(x, y - 3, name, "middle", INK),
        text(x, y + 13, detail, "middle", FAINT),
    ]


def _line(x0: float, y0: float, x1: float, y1: float) -> str:
    return f'<path d="M{x0} {y0}L{x1} {y1}" stroke="{INK}" fill="none"/>'


def _arrow(x0: float, y0: float, x1: float, y1: float) -> str:
    length = math.hypot(x1 - x0, y1 - y0)
    ux, uy = (x1 - x0) / length, (y1 - y0) / length
    tip = " ".join(
        f"{x1 - 7 * ux + s * 3.5 * uy:.1f},{y1 - 7 * uy - s * 3.5 * ux:.1f}" for s in (1, -1)
    )
    return _line(x0, y0, x1, y1) + f'<polygon points="{x1:.1f},{y1:.1f} {tip}" fill="{INK}"/>'
