# SPDX-License-Identifier: MIT OR Apache-2.0
"""The carrier's way over a picture, in one colour or by a value along it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.colours import colour

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.report.picture import View

WAY = "#c8331e"
_MOST_POINTS = 1200  # of a way; some at equal steps are drawn of a longer one
_SHADES = 48  # of a way that is coloured by a value
_JUMP = 1.0  # m from one drawn point to the next, beyond ten usual steps


@dataclass(frozen=True, slots=True)
class Way:
    """Places of the carrier in a picture.

    Attributes
    ----------
    across, up : (N,) m, along the picture's axes
    shares : (N,) 0 to 1, place of each in the colour map; None: one colour
    table : colour map
    """

    across: NDArray[np.float64]
    up: NDArray[np.float64]
    shares: NDArray[np.float64] | None = None
    table: tuple[str, ...] = ()


def draw_way(view: View, way: Way) -> str:
    """Draw a way as SVG over a view; its start is a circle."""
    if not len(way.across):
        return ""
    every = slice(None, None, max(len(way.across) // _MOST_POINTS, 1))
    x = (way.across[every] - view.left) / view.pixel
    y = (view.top - way.up[every]) / view.pixel
    places = [f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True)]
    step = np.zeros(len(places), np.intp)
    if way.shares is not None:
        step = np.rint(np.clip(way.shares[every], 0, 1) * (_SHADES - 1)).astype(np.intp)
    jumps = _jumps(way.across[every], way.up[every])
    flown = [0, *jumps.tolist(), len(step)]
    drawn = [_line(places[a:b], "#fff", 7.0, ' stroke-opacity=".75"') for a, b in pairwise(flown)]
    bounds = np.union1d(np.flatnonzero(np.diff(step)) + 1, flown).tolist()
    for first, last in pairwise(bounds):
        # A stretch ends where the next begins, save where nobody flew.
        piece = places[first : last + (last not in flown)]
        drawn.append(_line(piece, *_stroke(way, int(step[first]))))
    first_ink, _ = _stroke(way, int(step[0]))
    drawn.append(
        f'<circle cx="{x[0]:.1f}" cy="{y[0]:.1f}" r="8" fill="#fff" stroke="{first_ink}" stroke-width="4"/>'
    )
    return "".join(drawn)


def _jumps(across: NDArray[np.float64], up: NDArray[np.float64]) -> NDArray[np.intp]:
    """First points behind a break, or of another run: between them nobody flew."""
    steps = np.hypot(np.diff(across), np.diff(up))
    usual = float(np.median(steps)) if len(steps) else 0.0
    return np.flatnonzero(steps > _JUMP + 10 * usual) + 1


def _line(places: list[str], ink: str, width: float, more: str = "") -> str:
    return (
        f'<polyline points="{" ".join(places)}" fill="none" stroke-linejoin="round" '
        f'stroke="{ink}" stroke-width="{width:g}"{more}/>'
    )


def _stroke(way: Way, step: int) -> tuple[str, float]:
    """Return ink and width."""
    return (WAY, 3.6) if way.shares is None else (_ink(step, way.table), 4.2)


def _ink(step: int, table: tuple[str, ...]) -> str:
    r, g, b = np.rint(colour(np.array([step / (_SHADES - 1)]), table)[0]).astype(int)
    return f"#{r:02x}{g:02x}{b:02x}"
