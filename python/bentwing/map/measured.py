# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where refined points were measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def moved_back(points: Array, seen_from: Array, shifts: Array) -> Array:
    """Return points (N, 3) m before they were moved along their beams by shifts (N,) m.

    Parameters
    ----------
    seen_from : (N, 3) m, where the lidar was, or nearly was, when it measured them
    """
    beams = points - seen_from
    lengths = np.maximum(np.linalg.norm(beams, axis=1), 1e-6)
    measured: Array = points - beams * (shifts / lengths)[:, None]
    return measured
