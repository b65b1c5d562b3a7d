# SPDX-License-Identifier: MIT OR Apache-2.0
"""Two perceptually uniform colour maps, as small tables of equidistant colours."""

from __future__ import annotations

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


def colour(values: NDArray[np.float64], table: tuple[str, ...]) -> NDArray[np.float64]:
    """Colours `(N, 3)`, 0 to 255, of values `(N,)` between 0 and 1."""
    anchors = np.array([[int(code[i : i + 2], 16) for i in (0, 2, 4)] for code in table], float)
    at = np.clip(np.nan_to_num(values), 0, 1) * (len(anchors) - 1)
    below = np.minimum(at.astype(np.int64), len(anchors) - 2)
    share = (at - below)[:, None]
    mixed: NDArray[np.float64] = anchors[below] * (1 - share) + anchors[below + 1] * share
    return mixed


def gradient(table: tuple[str, ...]) -> list[str]:
    """Make the stops of an SVG gradient of a table."""
    last = len(table) - 1
    return [f'<stop offset="{i / last:.3f}" stop-color="#{code}"/>' for i, code in enumerate(table)]
