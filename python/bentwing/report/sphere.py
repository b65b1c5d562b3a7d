# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a head sees of the sphere around it, as a map of equal areas (Mollweide's)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.svg import GRID, open_svg, text

if TYPE_CHECKING:
    from numpy.typing import NDArray

_SEEN, _BLIND = "#2c5f8a", "#f0d9d2"
_WIDTH, _HEIGHT, _MARGIN = 560, 300, 26


def sphere_map(seen: NDArray[np.bool_], name: str) -> str:
    """Draw cells (E, A), elevation from the nadir up, azimuth from behind over ahead to behind."""
    rows, columns = seen.shape
    edges = np.linspace(-np.pi / 2, np.pi / 2, rows + 1)
    parts = [open_svg(_WIDTH, _HEIGHT, name), _band(-np.pi / 2, np.pi / 2, -1.0, 1.0, _BLIND)]
    for row, cells in enumerate(seen):
        flips = np.flatnonzero(np.diff(np.concatenate([[0], cells.astype(np.int8), [0]])))
        for first, last in flips.reshape(-1, 2):
            spans = 2.0 * np.array([first, last]) / columns - 1.0
            parts.append(_band(edges[row], edges[row + 1], spans[0], spans[1], _SEEN))
    for elevation in (-45, 0, 45):
        (x0, y), (x1, _) = (_place(np.radians(elevation), side) for side in (-1.0, 1.0))
        parts.append(
            f'<line x1="{x0:.1f}" x2="{x1:.1f}" y1="{y:.1f}" y2="{y:.1f}" stroke="{GRID}"/>'
        )
        parts.append(text(x0 - 6, y + 4, f"{elevation}°", "end"))
    middle = _WIDTH / 2
    parts += [text(middle, 16, "zenith", "middle"), text(middle, _HEIGHT - 6, "nadir", "middle")]
    return "".join([*parts, "</svg>"])


def _band(low: float, high: float, left: float, right: float, ink: str) -> str:
    """Part of the map between two elevations and two shares of the azimuth, as a polygon."""
    steps = np.linspace(low, high, 2 if high - low < 0.2 else 60)
    ways = [_place(e, left) for e in steps] + [_place(e, right) for e in steps[::-1]]
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in ways)
    return f'<polygon points="{points}" fill="{ink}" stroke="{ink}" stroke-width="1"/>'


def _place(elevation: float, side: float) -> tuple[float, float]:
    """Pixel of an elevation (rad) and a share of the azimuth, -1 to 1."""
    angle = elevation
    for _ in range(30):  # Newton; converges slowly at the poles, which half a pixel forgives
        slope = 2 + 2 * np.cos(2 * angle)
        if slope < 1e-9:
            break
        angle -= (2 * angle + np.sin(2 * angle) - np.pi * np.sin(elevation)) / slope
    x = _WIDTH / 2 + (_WIDTH / 2 - 2 * _MARGIN) * side * np.cos(angle)
    y = _HEIGHT / 2 - (_HEIGHT / 2 - _MARGIN) * np.sin(angle)
    return float(x), float(y)
