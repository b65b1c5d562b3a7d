# SPDX-License-Identifier: MIT OR Apache-2.0
"""Keep the returns within the range in which the lidar can be trusted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def within_range(
    points: NDArray[np.float64], min_range: float, max_range: float
) -> NDArray[np.bool_]:
    """Return which points are within [min_range, max_range].

    Parameters
    ----------
    points : (N, 3) float64, m, lidar frame
    min_range, max_range : m, from the lidar

    Returns
    -------
    (N,) bool
    """
    x, y, z = points.T
    squared = x * x + y * y + z * z
    return np.asarray((squared >= min_range**2) & (squared <= max_range**2))
