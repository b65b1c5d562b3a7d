# SPDX-License-Identifier: MIT OR Apache-2.0
"""Laser shots, before it is known what they hit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Beams:
    """Laser shots in the order of a grid whose neighbours along `sweep_axis` look side by side.

    Attributes
    ----------
    times : (A, B) s, IMU clock
    directions : (A, B, 3) unit vectors, lidar frame
    sweep_axis : 0 or 1
    """

    times: Array
    directions: Array
    sweep_axis: int
