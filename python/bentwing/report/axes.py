# SPDX-License-Identifier: MIT OR Apache-2.0
"""The axes of all plots: where a value is on the page, ticks and grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bentwing.report.svg import FAINT, GRID, nice_ticks, number, text

if TYPE_CHECKING:
    from collections.abc import Iterable

MARK = "#c8412e"
_LEFT, _RIGHT, _UPPER, _LOWER = 58.0, 12.0, 26.0, 40.0  # margins, pixels


@dataclass(frozen=True, slots=True)
class Axes:
    """Axes whose vertical one ends at ticks.

    Attributes
    ----------
    x_low, x_high : ends of the horizontal axis
    x_ticks, y_ticks : round numbers
    right, lower : pixels
    """

    x_low: float
    x_high: float
    x_ticks: list[float]
    y_ticks: list[float]
    right: float
    lower: float

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Pixel of a value."""
        low, high = self.y_ticks[0], self.y_ticks[-1]
        across = (x - self.x_low) / max(self.x_high - self.x_low, 1e-12)
        up = (y - low) / max(high - low, 1e-12)
        return _LEFT + across * (self.right - _LEFT), self.lower - up * (self.lower - _UPPER)

    def polyline(self, x: Iterable[float], y: Iterable[float], ink: str, width: float = 1.4) -> str:
        """Draw a line through values."""
        pairs = zip(x, y, strict=True)
        points = " ".join("{:.1f},{:.1f}".format(*self.place(a, b)) for a, b in pairs)
        style = f'fill="none" stroke="{ink}" stroke-width="{width:g}" stroke-linejoin="round"'
        return f'<polyline points="{points}" {style}/>'

    def bands(self, spans: Iterable[tuple[float, float]]) -> list[str]:
        """Mark stretches of the horizontal axis."""
        parts = []
        for first, last in spans:
            x0, _ = self.place(max(first, self.x_low), self.y_ticks[0])
            x1, _ = self.place(min(last, self.x_high), self.y_ticks[0])
            parts.append(
                f'<rect x="{x0:.1f}" y="{_UPPER}" width="{max(x1 - x0, 1.0):.1f}" '
                f'height="{self.lower - _UPPER}" fill="{MARK}" fill-opacity=".16"/>'
            )
        return parts

    def drawn(self) -> list[str]:
        """Draw grid, ticks and numbers."""
        parts = self.grid()
        for tick in self.x_ticks:
            x, _ = self.place(tick, self.y_ticks[0])
            parts += [
                f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{self.lower}" y2="{self.lower + 4}" stroke="{FAINT}"/>',
                text(x, self.lower + 18, number(tick), "middle"),
            ]
        return parts

    def grid(self) -> list[str]:
        """Draw the horizontal lines with their numbers."""
        parts = []
        for tick in self.y_ticks:
            _, y = self.place(self.x_low, tick)
            parts += [
                f'<line x1="{_LEFT}" x2="{self.right}" y1="{y:.1f}" y2="{y:.1f}" stroke="{GRID}"/>',
                text(_LEFT - 8, y + 4, number(tick), "end"),
            ]
        return parts


def fit_axes(
    x: tuple[float, float], y: tuple[float, float], size: tuple[int, int], n_ticks: int = 4
) -> Axes:
    """Make axes that hold the ranges `x` and `y` on a page of `size` pixels."""
    y_ticks = nice_ticks(*y, n_ticks)
    step = y_ticks[1] - y_ticks[0] if len(y_ticks) > 1 else 1.0
    # the axis ends at round numbers that hold everything
    if y_ticks[0] > y[0] + 1e-9 * step:
        y_ticks.insert(0, y_ticks[0] - step)
    if y_ticks[-1] < y[1] - 1e-9 * step:
        y_ticks.append(y_ticks[-1] + step)
    return Axes(*x, nice_ticks(*x, 7), y_ticks, size[0] - _RIGHT, size[1] - _LOWER)
