# SPDX-License-Identifier: MIT OR Apache-2.0
"""A wall in section, as two half-scans see it before and after a calibration."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.picture import PAPER, write_png

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

# Pixels of a panel, of the margins around it, and of a point's half edge.
WIDTH, HEIGHT, MARGIN, LABEL = 1000, 260, 24, 26
# What a panel shows, m: along the wall at most, and to each side of it.
LENGTH, DEPTH = 6.0, 0.12
COLOURS = np.array([[130, 170, 205], [235, 160, 140]])  # of the half-scans' points
MEANS = np.array([[20, 60, 105], [165, 45, 25]])  # and of their means, over so many pixels
BIN, MIN_IN_BIN = 40, 5
# Fewer points are drawn larger: edges in pixels.
FEW, SMALL, LARGE = 4000, 2, 4
INK, GRID = (60, 60, 60), (222, 222, 222)
GRID_STEP = 0.02  # m, across
SCALE = 3  # pixels of a dot of the letters
# Letters of 3 × 5 dots, a number per row; no library that is needed otherwise draws any.
GLYPHS = {
    "0": (7, 5, 5, 5, 7), "1": (2, 6, 2, 2, 7), "2": (7, 1, 7, 4, 7), "3": (7, 1, 7, 1, 7),
    "4": (5, 5, 7, 1, 1), "5": (7, 4, 7, 1, 7), "6": (7, 4, 7, 5, 7), "7": (7, 1, 1, 1, 1),
    "8": (7, 5, 7, 5, 7), "9": (7, 5, 7, 1, 7), ".": (0, 0, 0, 0, 2), ":": (0, 2, 0, 2, 0),
    " ": (0, 0, 0, 0, 0), "A": (2, 5, 7, 5, 5), "B": (6, 5, 6, 5, 6), "E": (7, 4, 6, 4, 7),
    "F": (7, 4, 6, 4, 4), "M": (5, 7, 7, 5, 5), "O": (7, 5, 5, 5, 7), "R": (6, 5, 6, 5, 5),
    "T": (7, 2, 2, 2, 2),
}  # fmt: skip


def draw_wall(
    path: Path,
    along: Sequence[Array],
    across: Sequence[Array],
    halves: Sequence[NDArray[np.int64]],
    gaps: Sequence[float],
) -> None:
    """Write a PNG: above before, below after; the lines across are 2 cm apart.

    Parameters
    ----------
    along, across : two arrays (N,) m each, before and after
    halves : two arrays (N,), 0 or 1
    gaps : m, between the halves, before and after
    """
    panels = [
        _panel(a, b, h, f"{name}: {1e3 * gap:.1f} MM")
        for name, a, b, h, gap in zip(("BEFORE", "AFTER"), along, across, halves, gaps, strict=True)
    ]
    write_png(path, np.vstack(panels))


def _panel(along: Array, across: Array, halves: NDArray[np.int64], title: str) -> NDArray[np.uint8]:
    height = HEIGHT + LABEL + MARGIN
    image = np.full((height, WIDTH + 2 * MARGIN, 3), PAPER, np.uint8)
    low = float(np.percentile(along, 1)) if len(along) else -LENGTH / 2
    high = float(np.percentile(along, 99)) if len(along) else LENGTH / 2
    half_count = int(DEPTH / GRID_STEP)
    for step in range(-half_count, half_count + 1):
        level = LABEL + round((0.5 - step * GRID_STEP / (2 * DEPTH)) * HEIGHT)
        image[level, MARGIN : MARGIN + WIDTH] = INK if step == 0 else GRID
    column = MARGIN + (along - low) / max(high - low, 1e-6) * WIDTH
    row = LABEL + (0.5 - across / (2 * DEPTH)) * HEIGHT
    inside = (column >= MARGIN) & (column < MARGIN + WIDTH - LARGE)
    inside &= (row >= LABEL) & (row < LABEL + HEIGHT - LARGE)
    _blend(image, row[inside].astype(np.intp), column[inside].astype(np.intp), halves[inside])
    for half in (0, 1):
        of = inside & (halves == half)
        _draw_means(image, row[of], column[of], MEANS[half])
    _write(image, title, MARGIN, 5)
    return image


def _blend(
    image: NDArray[np.uint8],
    rows: NDArray[np.intp],
    columns: NDArray[np.intp],
    halves: NDArray[np.int64],
) -> None:
    """Give every pixel the mean colour of the points in it, the more the darker."""
    shape = image.shape[:2]
    counts = np.zeros((2, *shape))
    edge = LARGE if len(rows) < FEW else SMALL
    for half in (0, 1):
        of = halves == half
        for down, right in np.ndindex(edge, edge):
            np.add.at(counts[half], (rows[of] + down, columns[of] + right), 1.0)
    total = counts.sum(axis=0)
    seen = total > 0
    mixed = np.einsum("hn,hc->nc", counts[:, seen] / total[seen], COLOURS)
    cover = 1.0 - 0.45 ** total[seen][:, None]
    image[seen] = np.rint(mixed * cover + image[seen] * (1.0 - cover)).astype(np.uint8)


def _draw_means(image: NDArray[np.uint8], rows: Array, columns: Array, colour: Array) -> None:
    """Draw the mean of the points in each bin as a dash."""
    bins = (columns / BIN).astype(np.intp)
    n = np.bincount(bins)
    means = np.bincount(bins, rows) / np.maximum(n, 1)
    for i in np.flatnonzero(n >= MIN_IN_BIN):
        at = round(float(means[i]))
        image[at - 1 : at + 2, i * BIN : (i + 1) * BIN] = colour


def _write(image: NDArray[np.uint8], text: str, left: int, top: int) -> None:
    for letter in text:
        for row, bits in enumerate(GLYPHS[letter]):
            for column in range(3):
                if bits >> (2 - column) & 1:
                    y, x = top + SCALE * row, left + SCALE * column
                    image[y : y + SCALE, x : x + SCALE] = INK
        left += 4 * SCALE
