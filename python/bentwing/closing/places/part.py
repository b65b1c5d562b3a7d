# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a place is made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MIN_POINTS = 500  # a place of fewer says nothing


@dataclass(frozen=True, slots=True)
class Part:
    """Points of one place: those of a span of time, or of a tile.

    Attributes
    ----------
    points : (N, 3) m, map frame
    span : s, of the points; None where they have no times
    origins : (N, 3) m, where each was measured from; None where that is unknown
    """

    points: NDArray[np.float64]
    span: tuple[float, float] | None
    origins: NDArray[np.float64] | None
