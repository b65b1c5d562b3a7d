# SPDX-License-Identifier: MIT OR Apache-2.0
"""Two perceptually uniform colour maps, as small tables of equidistant colours."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Colours of viridis and plasma (Smith and van der Walt, released as CC0); the darkest of viridis
# are left out, because the ground, most of a map, would drown in them.
HEIGHT = (
    "3f4889", "355e8d", "29798e", "21918c", "22a884", "44bf70", "7ad151", "bddf26", "fde725",
)  # fmt: skip
TIME = (
    "0d0887", "4c02a1", "7e03a8", "a92395", "cc4778", "e56b5d", "f89540", "fdc527", "f0f921",
)  # fmt: skip
# Moreland 2009, a diverging map: blue is below zero, red above.
ERROR = ("3b4cc0", "7b9ff9", "c0d4f5", "dddddd", "f2cbb7", "ee8468", "b40426")

_SHADES = 1024  # of a colour map; neighbours differ by less than one of 256 levels


def colour(values: NDArray[np.float64], table: tuple[str, ...]) -> NDArray[np.float32]:
    """Colours `(N, 3)`, 0 to 255, of values `(N,)` between 0 and 1."""
    at = np.clip(np.nan_to_num(values), 0, 1) * (_SHADES - 1)
    return _shades(table).take(np.rint(at).astype(np.intp), axis=0)


def ints(code: str) -> list[int]:
    """Return red, green and blue, 0 to 255, of a colour's code."""
    return [int(code[i : i + 2], 16) for i in (0, 2, 4)]


@lru_cache
def _shades(table: tuple[str, ...]) -> NDArray[np.float32]:
    """Colours `(_SHADES, 3)` from one end of a table to the other."""
    anchors = np.array([ints(code) for code in table], float)
    at, places = np.linspace(0, 1, _SHADES), np.linspace(0, 1, len(table))
    return np.stack([np.interp(at, places, c) for c in anchors.T], axis=1).astype(np.float32)


def gradient(table: tuple[str, ...]) -> list[str]:
    """Make the stops of an SVG gradient of a table."""
    last = len(table) - 1
    return [f'<stop offset="{i / last:.3f}" stop-color="#{code}"/>' for i, code in enumerate(table)]
