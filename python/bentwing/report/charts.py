# SPDX-License-Identifier: MIT OR Apache-2.0
"""Distributions, boxplots and scatter plots as inline SVG."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.axes import Axes, fit_axes
from bentwing.report.plot import SERIES_COLOURS
from bentwing.report.svg import INK, open_svg, text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.evaluate.robust import Line
    from bentwing.evaluate.statistics import Box

WIDTH, HEIGHT = 640, 340
_BINS = 80
_MOST_DOTS = 3000
_BOX, _CAP = 13.0, 7.0  # half widths, pixels


@dataclass(frozen=True, slots=True)
class Sample:
    """A named set of values `(N,)`, N > 0."""

    name: str
    values: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BoxGroup:
    """Boxes of one kind, one per place on the horizontal axis."""

    name: str
    boxes: Sequence[Box]


def histogram(
    samples: Sequence[Sample], x_label: str, span: tuple[float, float], note: str = ""
) -> str:
    """Draw distributions over common bins, as the share of each sample per bin.

    Parameters
    ----------
    samples : what is drawn; values beyond the span count, and are not seen
    x_label : with unit
    span : ends of the horizontal axis
    note : put below the legend
    """
    edges = np.linspace(*span, _BINS + 1)
    shares = [100 * np.histogram(s.values, edges)[0] / len(s.values) for s in samples]
    axes = fit_axes(span, (0.0, max(float(share.max()) for share in shares)), (WIDTH, HEIGHT))
    parts = _frame(axes, x_label, "share per bin, %")
    for share, ink in zip(shares, SERIES_COLOURS, strict=False):
        x = np.repeat(edges, 2)
        y = np.concatenate([[0.0], np.repeat(share, 2), [0.0]])
        if len(samples) == 1:
            points = " ".join(
                "{:.1f},{:.1f}".format(*axes.place(a, b)) for a, b in zip(x, y, strict=True)
            )
            parts.append(f'<polygon points="{points}" fill="{ink}" fill-opacity=".18"/>')
        parts.append(axes.polyline(x, y, ink, 1.8))
    parts += _legend([s.name for s in samples], axes)
    if note:
        parts.append(
            text(axes.right - 6, 44 + 16 * len(samples) * (len(samples) > 1), note, "end", INK)
        )
    return "".join([*parts, "</svg>"])


def scatter(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    labels: tuple[str, str],
    line: Line | None,
    top: float,
) -> str:
    """Draw dots and a line of best fit; the axes begin at zero.

    Parameters
    ----------
    x, y : (N,) not negative
    labels : of the axes, with unit
    line : in black
    top : upper end of the vertical axis; dots beyond are drawn at the edge
    """
    axes = fit_axes((0.0, max(float(x.max()), 1e-9) * 1.02), (0.0, top), (WIDTH, HEIGHT))
    parts = _frame(axes, *labels)
    step = -(-len(x) // _MOST_DOTS)
    for a, b in zip(x[::step].tolist(), y[::step].tolist(), strict=True):
        px, py = axes.place(a, min(b, axes.y_ticks[-1]))
        parts.append(
            f'<circle cx="{px:.1f}" cy="{py:.1f}" r="1.7" fill="{SERIES_COLOURS[0]}" fill-opacity=".45"/>'
        )
    if line is not None:
        ends = np.array([0.0, axes.x_high])
        heights = np.clip(line.intercept + line.slope * ends, 0.0, axes.y_ticks[-1])
        parts.append(axes.polyline(ends, heights, "#111", 2.0))
    return "".join([*parts, "</svg>"])


def box_plot(
    groups: Sequence[BoxGroup], places: Sequence[str], labels: tuple[str, str], factor: float
) -> str:
    """Draw boxes side by side: circle the median, bars the quartiles, whiskers 3 and 97 %.

    Parameters
    ----------
    groups : each with one box per place
    places : names along the horizontal axis
    labels : of the axes, with unit
    factor : from the boxes' unit to that of the vertical axis
    """
    ends = [(factor * box.p3, factor * box.p97) for group in groups for box in group.boxes]
    low, high = min(0.0, *(e[0] for e in ends)), max(0.0, *(e[1] for e in ends))
    axes = fit_axes((0.0, float(len(places))), (low, high), (WIDTH, HEIGHT), 6)
    parts = [
        open_svg(WIDTH, HEIGHT, f"{labels[1]} by {labels[0]}"),
        *axes.grid(),
        text(axes.right, HEIGHT - 4, labels[0], "end"),
        text(4, 13, labels[1], "start"),
    ]
    for i, place in enumerate(places):
        middle, _ = axes.place(i + 0.5, 0.0)
        parts.append(text(middle, axes.lower + 18, place, "middle"))
        for j, (group, ink) in enumerate(zip(groups, SERIES_COLOURS, strict=False)):
            at = middle + 3.2 * _BOX * (j - (len(groups) - 1) / 2)
            parts += _box(axes, at, group.boxes[i], ink, factor)
    parts += _legend([group.name for group in groups], axes)
    return "".join([*parts, "</svg>"])


def _box(axes: Axes, x: float, box: Box, ink: str, factor: float) -> list[str]:
    p3, p25, p50, p75, p97 = (
        axes.place(0.0, factor * value)[1]
        for value in (box.p3, box.p25, box.median, box.p75, box.p97)
    )
    stroke = f'stroke="{ink}" stroke-width="1.5"'
    return [
        f'<path d="M{x:.1f} {p3:.1f}V{p25:.1f}M{x:.1f} {p75:.1f}V{p97:.1f}'
        f'M{x - _CAP:.1f} {p3:.1f}h{2 * _CAP}M{x - _CAP:.1f} {p97:.1f}h{2 * _CAP}" fill="none" {stroke}/>',
        f'<rect x="{x - _BOX:.1f}" y="{p75:.1f}" width="{2 * _BOX}" height="{max(p25 - p75, 0.5):.1f}" '
        f'fill="{ink}" fill-opacity=".15" {stroke}/>',
        f'<circle cx="{x:.1f}" cy="{p50:.1f}" r="3.4" fill="#fff" {stroke}/>',
    ]


def _frame(axes: Axes, x_label: str, y_label: str) -> list[str]:
    return [
        open_svg(WIDTH, HEIGHT, f"{y_label} over {x_label}"),
        *axes.drawn(),
        text(axes.right, HEIGHT - 4, x_label, "end"),
        text(4, 13, y_label, "start"),
    ]


def _legend(names: Sequence[str], axes: Axes) -> list[str]:
    """Names in their colours, one below the other, unless there is but one."""
    if len(names) < 2:
        return []
    return [
        text(axes.right - 6, 42 + 16 * i, name, "end", ink)
        for i, (name, ink) in enumerate(zip(names, SERIES_COLOURS, strict=False))
    ]
