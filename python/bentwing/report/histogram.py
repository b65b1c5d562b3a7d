# SPDX-License-Identifier: MIT OR Apache-2.0
"""Stacked histograms as inline SVG."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.plot import SERIES_COLOURS
from bentwing.report.svg import FAINT, GRID, nice_ticks, number, open_svg, text

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

_EXTRA = ("#7a5c99",)
_WIDTH, _HEIGHT = 560, 260
_LEFT, _RIGHT, _UPPER, _LOWER = 58, 548, 26, 220


def histogram(
    samples: Mapping[str, NDArray[np.float64]], edges: NDArray[np.float64], x_label: str
) -> str:
    """Stack the samples of each name over common bins, as shares of all samples."""
    total = max(1, sum(len(values) for values in samples.values()))
    counts = [np.histogram(values, edges)[0] / total for values in samples.values()]
    highest = float(np.sum(counts, axis=0).max())
    ticks = nice_ticks(0.0, highest, 4)
    if ticks[-1] < highest:
        ticks.append(2 * ticks[-1] - ticks[-2])
    parts = [open_svg(_WIDTH, _HEIGHT, f"share of the time over {x_label}"), *_axes(edges, ticks)]
    below = np.zeros(len(edges) - 1)
    inks = [*SERIES_COLOURS, *_EXTRA]
    for k, (name, shares) in enumerate(zip(samples, counts, strict=True)):
        ink = inks[k % len(inks)]
        for left, right, low, share in zip(edges[:-1], edges[1:], below, shares, strict=True):
            x0, x1 = _across(left, edges), _across(right, edges)
            y0, y1 = _up(low, ticks), _up(low + share, ticks)
            parts.append(
                f'<rect x="{x0 + 0.5:.1f}" y="{y1:.1f}" width="{x1 - x0 - 1:.1f}" '
                f'height="{y0 - y1:.1f}" fill="{ink}"/>'
            )
        below = below + shares
        parts.append(text(_RIGHT, 40 + 15 * k, name, "end", ink))
    parts += [text(_RIGHT, _HEIGHT - 4, x_label, "end"), text(4, 13, "share of the time", "start")]
    return "".join([*parts, "</svg>"])


def _axes(edges: NDArray[np.float64], ticks: list[float]) -> list[str]:
    parts = []
    for tick in ticks:
        y = _up(tick, ticks)
        parts += [
            f'<line x1="{_LEFT}" x2="{_RIGHT}" y1="{y:.1f}" y2="{y:.1f}" stroke="{GRID}"/>',
            text(_LEFT - 8, y + 4, number(tick), "end"),
        ]
    for tick in nice_ticks(float(edges[0]), float(edges[-1]), 7):
        x = _across(tick, edges)
        parts += [
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{_LOWER}" y2="{_LOWER + 4}" stroke="{FAINT}"/>',
            text(x, _LOWER + 18, number(tick), "middle"),
        ]
    return parts


def _across(value: float, edges: NDArray[np.float64]) -> float:
    return float(_LEFT + (value - edges[0]) / (edges[-1] - edges[0]) * (_RIGHT - _LEFT))


def _up(value: float, ticks: list[float]) -> float:
    return _LOWER - value / max(ticks[-1], 1e-12) * (_LOWER - _UPPER)
