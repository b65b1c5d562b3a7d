# SPDX-License-Identifier: MIT OR Apache-2.0
"""Title, grid, scale bar, legend and north around pictures of pixels, without any drawing library."""

from __future__ import annotations

import math
import unicodedata
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.colours import colour
from bentwing.report.picture import PAPER
from bentwing.report.svg import nice_ticks

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
    "9": (14, 17, 17, 15, 1, 2, 12), ".": (0, 0, 0, 0, 0, 12, 12), ",": (0, 0, 0, 0, 12, 4, 8),
    "-": (0, 0, 0, 31, 0, 0, 0), "_": (0, 0, 0, 0, 0, 0, 31), "/": (1, 1, 2, 4, 8, 16, 16), ":": (0, 12, 12, 0, 12, 12, 0),
    "=": (0, 0, 31, 0, 31, 0, 0), "m": (0, 0, 26, 21, 21, 21, 21), "k": (16, 16, 18, 20, 24, 20, 18),
    "s": (0, 0, 15, 16, 14, 1, 30), "y": (0, 0, 17, 17, 15, 1, 14), "z": (0, 0, 31, 2, 4, 8, 31),
    "A": (14, 17, 17, 31, 17, 17, 17), "B": (30, 17, 17, 30, 17, 17, 30), "C": (14, 17, 16, 16, 16, 17, 14),
    "D": (30, 17, 17, 17, 17, 17, 30), "E": (31, 16, 16, 30, 16, 16, 31), "F": (31, 16, 16, 30, 16, 16, 16),
    "G": (14, 17, 16, 23, 17, 17, 15), "H": (17, 17, 17, 31, 17, 17, 17), "I": (14, 4, 4, 4, 4, 4, 14),
    "J": (7, 2, 2, 2, 2, 18, 12), "K": (17, 18, 20, 24, 20, 18, 17), "L": (16, 16, 16, 16, 16, 16, 31),
    "M": (17, 27, 21, 21, 17, 17, 17), "N": (17, 25, 21, 19, 17, 17, 17), "O": (14, 17, 17, 17, 17, 17, 14),
    "P": (30, 17, 17, 30, 16, 16, 16), "Q": (14, 17, 17, 17, 21, 18, 13), "R": (30, 17, 17, 30, 20, 18, 17),
    "S": (15, 16, 16, 14, 1, 1, 30), "T": (31, 4, 4, 4, 4, 4, 4), "U": (17, 17, 17, 17, 17, 17, 14),
    "V": (17, 17, 17, 17, 17, 10, 4), "W": (17, 17, 17, 21, 21, 21, 10), "X": (17, 17, 10, 4, 10, 17, 17),
    "Y": (17, 17, 10, 4, 4, 4, 4), "Z": (31, 1, 2, 4, 8, 16, 31),
}  # fmt: skip
_STROKE = 3  # pixels
_FOOT, _HEAD, _SIDE = 104, 44, 200  # pixels below, above and at the left of the picture
_MARGIN, _SIZE = 16, 3
_LETTER = 6 * _SIZE  # pixels that a letter is wide
_NARROWEST = 1000  # pixels in which title, bar and legend have room
_LINES = 6  # of the grid, about, along the longer side
_GRID = 0.72  # of the brightness that a line of the grid leaves
_BAR = (300, 14)  # pixels of the legend


@dataclass(frozen=True, slots=True)
class Lettering:
    """What is written around a picture.

    Attributes
    ----------
    title : of the picture
    up : `N` where the picture is north up, `y` or `z` of the map elsewhere
    unit : of the values that the colours show
    table : colour map
    origin : m, to add to both axes of the picture for the coordinates of the grid
    """

    title: str
    up: str
    unit: str
    table: tuple[str, ...]
    origin: tuple[float, float] = (0.0, 0.0)


def lettered(view: View, words: Lettering) -> Image:
    """Put title, grid with coordinates, scale bar, legend and an arrow around a picture."""
    rows, columns, _ = view.image.shape
    wide = _SIDE + max(columns, _NARROWEST) + _MARGIN
    image = np.full((_HEAD + rows + _FOOT, wide, 3), PAPER, np.uint8)
    image[_HEAD : _HEAD + rows, _SIDE : _SIDE + columns] = view.image
    write(image, (12, _SIDE), f"{words.title}, 1 PIXEL = {_length(view.pixel)}")
    _grid(image, view, words.origin)
    base = _HEAD + rows + 66
    metres, pixels = bar_length(view.pixel, columns)
    image[base : base + _STROKE, _SIDE : _SIDE + pixels] = INK
    for at in (_SIDE, _SIDE + pixels - _STROKE):
        image[base - 8 : base + _STROKE, at : at + _STROKE] = INK
    write(image, (base + 12, _SIDE), _length(metres))
    _legend(image, view, words, (base - 8, wide - _MARGIN - _BAR[0]))
    _arrow(image, (_HEAD, _MARGIN), words.up)
    return image


def _length(metres: float) -> str:
    if metres >= 1000:
        return f"{metres / 1000:g} km"
    return f"{metres:g} m" if metres >= 1 else f"{1000 * metres:g} mm"


def _grid(image: Image, view: View, origin: tuple[float, float]) -> None:
    rows, columns, _ = view.image.shape
    left, top = view.left + origin[0], view.top + origin[1]
    ticks = nice_ticks(0.0, max(rows, columns) * view.pixel, _LINES)
    step = ticks[1] - ticks[0] if len(ticks) > 1 else 1.0
    end = -1
    inside = image[_HEAD : _HEAD + rows, _SIDE : _SIDE + columns]
    for x in multiples(left, left + columns * view.pixel, step):
        at = min(int((x - left) / view.pixel), columns - 1)
        inside[:, at] = (_GRID * inside[:, at]).astype(np.uint8)
        label = coordinate(x)
        place = max(_SIDE + at - len(label) * _LETTER // 2, 0)
        if place > end:  # no label on another
            write(image, (_HEAD + rows + 10, place), label)
            end = place + (len(label) + 1) * _LETTER
    for y in multiples(top - rows * view.pixel, top, step):
        at = min(int((top - y) / view.pixel), rows - 1)
        inside[at] = (_GRID * inside[at]).astype(np.uint8)
        label = coordinate(y)
        write(image, (_HEAD + at - 10, _SIDE - 10 - len(label) * _LETTER), label)


def multiples(low: float, high: float, step: float) -> list[float]:
    """Return the multiples of a step from one value to another."""
    return [i * step for i in range(math.ceil(low / step), math.floor(high / step) + 1)]


def coordinate(value: float) -> str:
    """Write a coordinate of a grid: whole metres without a fraction."""
    return f"{value:,.0f}" if abs(value) >= 10 else f"{value + 0.0:g}"


def _legend(image: Image, view: View, words: Lettering, corner: tuple[int, int]) -> None:
    row, column = corner
    wide, high = _BAR
    shades = colour(np.linspace(0.0, 1.0, wide), words.table)
    image[row : row + high, column : column + wide] = np.rint(shades).astype(np.uint8)
    low_label, high_label = f"{view.low:.1f}", f"{view.high:.1f} {words.unit}"
    write(image, (row + high + 6, column), low_label)
    write(image, (row + high + 6, column + wide - len(high_label) * _LETTER), high_label)


def bar_length(pixel: float, columns: int) -> tuple[float, int]:
    """Return a round length in m, at most a quarter of the picture, and its pixels."""
    longest = pixel * columns / 4
    magnitude = 10.0 ** math.floor(math.log10(longest))
    metres = max(m * magnitude for m in (1, 2, 5) if m * magnitude <= longest)
    return metres, round(metres / pixel)


def write(image: Image, corner: tuple[int, int], text: str, size: int = _SIZE) -> None:
    """Write a text with its upper left corner at a row and a column; unknown letters are blank."""
    row, column = corner
    for letter in unicodedata.normalize("NFKD", text):
        if unicodedata.combining(letter):
            continue
        glyph = _GLYPHS.get(letter) or _GLYPHS.get(letter.upper()) or (0,) * 7
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
    write(image, (row + 16, column + 22), name)
