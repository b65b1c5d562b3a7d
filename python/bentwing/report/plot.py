# SPDX-License-Identifier: MIT OR Apache-2.0
"""Line plots as inline SVG."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.axes import fit_axes
from bentwing.report.svg import open_svg, text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.report.axes import Axes

SERIES_COLOURS = ("#2c5f8a", "#c8553d", "#4d8b57", "#8a6d3b", "#7a5c99", "#3b9aa0")
_MOST_POINTS = 1200  # of one line; more are drawn as their envelope


@dataclass(frozen=True, slots=True)
class Series:
    """A line of a plot: `x` and `y` are `(N,)`; what is not finite is left out."""

    name: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]


def line_plot(
    series: Sequence[Series],
    x_label: str,
    y_label: str,
    *,
    width: int = 560,
    height: int = 220,
    top: float | None = None,
    bands: Sequence[tuple[float, float]] = (),
) -> str:
    """Plot lines over common axes, of which the vertical one includes zero.

    Parameters
    ----------
    series : what is drawn; named in a legend if there is more than one
    x_label, y_label : with unit
    width, height : pixels of the SVG's own coordinates; it scales to its place
    top : upper end of the vertical axis, if it is known
    bands : stretches of the horizontal axis that are marked
    """
    lines = [line for line in map(_finite, series) if len(line.x)]
    if not lines:
        return '<p class="none">Not recorded.</p>'
    axes = _axes(lines, (width, height), top)
    parts = [
        open_svg(width, height, f"{y_label} over {x_label}"),
        *axes.bands(bands),
        *axes.drawn(),
        text(axes.right, height - 4, x_label, "end"),
        text(4, 13, y_label, "start"),
    ]
    legend = axes.right
    for line, ink in reversed(list(zip(lines, SERIES_COLOURS, strict=False))):
        parts.append(axes.polyline(*_envelope(line), ink))
        if len(lines) > 1:
            parts.append(text(legend, 13, line.name, "end", ink))
            legend -= 7.0 * len(line.name) + 14
    return "".join([*parts, "</svg>"])


def _axes(lines: list[Series], size: tuple[int, int], top: float | None) -> Axes:
    x = min(line.x.min() for line in lines), max(line.x.max() for line in lines)
    y_low = min(0.0, *(float(line.y.min()) for line in lines))
    y_high = max(0.0, *(float(line.y.max()) for line in lines)) if top is None else top
    return fit_axes((float(x[0]), float(x[1])), (y_low, y_high), size)


def _finite(line: Series) -> Series:
    x, y = np.asarray(line.x, np.float64), np.asarray(line.y, np.float64)
    good = np.isfinite(x) & np.isfinite(y)
    return Series(line.name, x[good], y[good])


def _envelope(line: Series) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Thin a long line to the lowest and highest of each group of points, so that peaks stay."""
    size = -(-2 * len(line.x) // _MOST_POINTS)
    if size <= 2:
        return line.x, line.y
    whole = len(line.x) // size * size
    groups = line.y[:whole].reshape(-1, size)
    order = np.sort(np.stack([groups.argmin(axis=1), groups.argmax(axis=1)], axis=1), axis=1)
    index = (np.arange(len(groups))[:, None] * size + order).ravel()
    return line.x[index], line.y[index]
