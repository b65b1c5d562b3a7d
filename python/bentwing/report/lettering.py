# SPDX-License-Identifier: MIT OR Apache-2.0
"""Scale bar, north and letters on pictures of pixels, without any drawing library."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.picture import PAPER

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.report.picture import View

    Image = NDArray[np.uint8]

INK = (60, 70, 83)
# seven rows of five pixels, the leftmost is the highest bit
_GLYPHS = {
    "0": (14, 17, 19, 21, 25, 17, 14), "1": (4, 12, 4, 4, 4, 4, 14), "2": (14, 17, 1, 2, 4, 8, 31),
    "3": (31, 2, 4, 2, 1, 17, 14), "4": (2, 6, 10, 18, 31, 2, 2), "5": (31, 16, 30, 1, 1, 17, 14),
    "6": (6, 8, 16, 30, 17, 17, 14), "7": (31, 1, 2, 4, 8, 8, 8), "8": (14, 17, 17, 14, 17, 17, 14),
    "9": (14, 17, 17, 15, 1, 2, 12), ".": (0, 0, 0, 0, 0, 12, 12), " ": (0,) * 7,
    "m": (0, 0, 26, 21, 21, 21, 21), "k": (16, 16, 18, 20, 24, 20, 18), "s": (0, 0, 15, 16, 14, 1, 30),
    "N": (17, 25, 21, 19, 17, 17, 17), "y": (0, 0, 17, 17, 15, 1, 14), "z": (0, 0, 31, 2, 4, 8, 31),
}  # fmt: skip
_STROKE = 3  # pixels
_FOOT = 64  # rows below the picture
_MARGIN = 16


def with_scale(view: View, up: str) -> Image:
    """Add a scale bar below a picture, and an arrow with the name of what points up.

    Parameters
    ----------
    view : the picture
    up : `N` where the picture is north up, `y` or `z` of the map elsewhere
    """
    rows, columns, _ = view.image.shape
    image = np.full((rows + _FOOT, max(columns, 240), 3), PAPER, np.uint8)
    image[:rows, :columns] = view.image
    metres, pixels = bar_length(view.pixel, columns)
    base = rows + 24
    image[base : base + _STROKE, _MARGIN : _MARGIN + pixels] = INK
    for at in (_MARGIN, _MARGIN + pixels - _STROKE):
        image[base - 8 : base + _STROKE, at : at + _STROKE] = INK
    label = f"{metres / 1000:g} km" if metres >= 1000 else f"{metres:g} m"
    write(image, (base + 10, _MARGIN), label)
    _arrow(image, (rows + 8, image.shape[1] - 3 * _MARGIN), up)
    return image


def bar_length(pixel: float, columns: int) -> tuple[float, int]:
    """Return a round length in m, at most a quarter of the picture, and its pixels."""
    longest = pixel * columns / 4
    magnitude = 10.0 ** math.floor(math.log10(longest))
    metres = max(m * magnitude for m in (1, 2, 5) if m * magnitude <= longest)
    return metres, round(metres / pixel)


def write(image: Image, corner: tuple[int, int], text: str, size: int = 3) -> None:
    """Write a text with its upper left corner at a row and a column; unknown letters are blank."""
    row, column = corner
    for letter in text:
        glyph = _GLYPHS.get(letter, _GLYPHS[" "])
        bits = np.array([[line >> (4 - i) & 1 for i in range(5)] for line in glyph], np.bool_)
        big = bits.repeat(size, axis=0).repeat(size, axis=1)
        part = image[row : row + big.shape[0], column : column + big.shape[1]]
        part[big[: part.shape[0], : part.shape[1]]] = INK
        column += 6 * size


def _arrow(image: Image, corner: tuple[int, int], name: str) -> None:
    row, column = corner
    for k in range(12):  # the head grows downwards
        image[row + k, column + 12 - k // 2 : column + 13 + k // 2] = INK
    image[row + 12 : row + 44, column + 11 : column + 11 + _STROKE] = INK
    write(image, (row + 16, column - 10), name)
