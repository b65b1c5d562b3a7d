# SPDX-License-Identifier: MIT OR Apache-2.0
"""A drawing on paper at a round scale: where everything lies, in mm, whatever file it becomes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from bentwing.base.errors import UsageError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

Layer = Literal["POINTS", "WALLS", "CONTOURS", "GRID", "TITLE"]
INK, FAINT, LINE = "#1f2933", "#6b7684", "#c3ccd6"
SCALES = tuple(m * 10**k for k in range(1, 5) for m in (1, 2, 5))
_PAPERS = {
    "A4": (210, 297),
    "A3": (297, 420),
    "A2": (420, 594),
    "A1": (594, 841),
    "A0": (841, 1189),
}
_USUAL = "A3"  # the largest paper that is taken without being asked
MARGIN = 10.0  # mm between the paper's edge and the frame
FOOT = 32.0  # mm, height of the title block
LABELS = (15.0, 6.0)  # mm between the frame and the drawing, at the left and below
_FINEST_GRID = 18.0  # mm between two lines
_FROM_EDGE = 2.0  # mm between the frame and a line of the grid
_SMALL = 2.2  # mm, height of letters


@dataclass(frozen=True, slots=True)
class Stroke:
    """A line through points (N, 2), mm from the lower left corner; `level` is its height, m, if it has one."""

    layer: Layer
    points: Array
    width: float
    ink: str = INK
    level: float | None = None


@dataclass(frozen=True, slots=True)
class Letters:
    """A text; `at` is the mm of its baseline, at its start, middle or end."""

    layer: Layer
    at: tuple[float, float]
    content: str
    height: float
    anchor: Literal["start", "middle", "end"] = "start"
    ink: str = INK


@dataclass(slots=True)
class Sheet:
    """Paper with a drawing on it.

    Attributes
    ----------
    paper : its name
    size : mm, width and height
    scale : 50 for 1:50
    corner : (2,) m, place of the paper's lower left corner in the drawing
    places, counts : (K, 2) m and (K,), of the measured points
    strokes, letters : lie on the points, in their order
    """

    paper: str
    size: tuple[int, int]
    scale: int
    corner: Array
    places: Array = field(default_factory=lambda: np.empty((0, 2)))
    counts: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    strokes: list[Stroke] = field(default_factory=list)
    letters: list[Letters] = field(default_factory=list)

    @property
    def area(self) -> tuple[float, float, float, float]:
        """Left, lower, right and upper edge of the drawing, mm."""
        width, height = self.size
        left, lower = MARGIN + LABELS[0], MARGIN + FOOT + LABELS[1]
        return left, lower, width - MARGIN, height - MARGIN

    def on_paper(self, places: Array) -> Array:
        """Return the mm (N, 2) of places (N, 2) m."""
        mm: Array = (places - self.corner) * (1000 / self.scale)
        return mm

    def inside(self, places: Array) -> NDArray[np.bool_]:
        """Tell which places (N, 2) m are in the drawing."""
        left, lower, right, upper = self.area
        x, y = self.on_paper(places).T
        found: NDArray[np.bool_] = (x >= left) & (x <= right) & (y >= lower) & (y <= upper)
        return found

    def write(
        self,
        at: tuple[float, float],
        content: str,
        height: float = _SMALL,
        anchor: Literal["start", "middle", "end"] = "start",
        *,
        ink: str = INK,
        layer: Layer = "TITLE",
    ) -> None:
        """Add a text."""
        self.letters.append(Letters(layer, at, content, height, anchor, ink))

    def stroke(
        self, layer: Layer, points: list[tuple[float, float]], width: float, ink: str = INK
    ) -> None:
        """Add a line through points, mm."""
        self.strokes.append(Stroke(layer, np.array(points), width, ink))


def lay_out(low: Array, high: Array, scale: int | None = None) -> Sheet:
    """Choose paper and scale for a drawing, which lies in the middle.

    Parameters
    ----------
    low, high : (2,) m, corners of what is drawn
    scale : 50 for 1:50; default: the largest round one with which it fits on A3

    Raises
    ------
    UsageError
        If it is too large for A0 at the scale.
    """
    extent = np.maximum(high - low, 0.1)
    if scale is None:
        usual = [_USUAL]
        scale = next((s for s in SCALES if _fitting(extent, s, usual) is not None), SCALES[-1])
    fitting = _fitting(extent, scale, list(_PAPERS))
    if fitting is None:
        needed = next((s for s in SCALES if _fitting(extent, s, list(_PAPERS))), SCALES[-1])
        width, height = (1000 * extent / scale).round()
        msg = (
            f"--scale {scale}: the drawing would be {width:.0f} x {height:.0f} mm, more than A0 holds; "
            f"give {needed} or more"
        )
        raise UsageError(msg)
    paper, size = fitting
    sheet = Sheet(paper, size, scale, np.zeros(2))
    left, lower, right, upper = sheet.area
    middle = np.array([left + right, lower + upper]) / 2
    sheet.corner = (low + high) / 2 - middle * scale / 1000
    return sheet


def _fitting(extent: Array, scale: int, papers: list[str]) -> tuple[str, tuple[int, int]] | None:
    """Return the smallest paper and its width and height, lying if possible."""
    width, height = 1000 * extent / scale
    for name in papers:
        short, long = _PAPERS[name]
        for size in ((long, short), (short, long)):
            free = size[0] - 2 * MARGIN - LABELS[0], size[1] - 2 * MARGIN - FOOT - LABELS[1]
            if width <= free[0] and height <= free[1]:
                return name, size
    return None


def add_grid(sheet: Sheet) -> None:
    """Draw lines at round coordinates, with their numbers, and the frames of drawing and paper."""
    left, lower, right, upper = sheet.area
    interval = grid_interval(sheet.scale)
    for axis, (start, end) in enumerate(((left, right), (lower, upper))):
        first, last = sheet.corner[axis] + np.array([start, end]) * sheet.scale / 1000
        ticks = range(math.ceil(first / interval - 1e-9), math.floor(last / interval + 1e-9) + 1)
        for tick in ticks:
            at = (tick * interval - sheet.corner[axis]) * 1000 / sheet.scale
            if min(at - start, end - at) < _FROM_EDGE:
                continue  # its number would lie on the frame
            number = f"{tick * interval:.10g}"
            if axis == 0:
                sheet.stroke("GRID", [(at, lower), (at, upper)], 0.1, LINE)
                sheet.write((at, lower - 4.0), number, anchor="middle", ink=FAINT, layer="GRID")
            else:
                sheet.stroke("GRID", [(left, at), (right, at)], 0.1, LINE)
                sheet.write((left - 1.5, at - 0.8), number, anchor="end", ink=FAINT, layer="GRID")
    add_box(sheet, "GRID", (left, lower, right, upper), 0.25)
    width, height = sheet.size
    add_box(sheet, "TITLE", (MARGIN, MARGIN, width - MARGIN, height - MARGIN), 0.5)


def grid_interval(scale: int) -> float:
    """Return a round interval, m, that is legible on paper at a scale."""
    least = _FINEST_GRID * scale / 1000
    magnitude = 10.0 ** math.floor(math.log10(least))
    return next(m * magnitude for m in (1, 2, 5, 10) if m * magnitude >= least)


def add_box(
    sheet: Sheet, layer: Layer, box: tuple[float, float, float, float], width: float
) -> None:
    """Draw a rectangle of left, lower, right and upper edge, mm."""
    left, lower, right, upper = box
    corners = [(left, lower), (right, lower), (right, upper), (left, upper), (left, lower)]
    sheet.stroke(layer, corners, width)
