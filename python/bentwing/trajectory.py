# SPDX-License-Identifier: MIT OR Apache-2.0
"""The trajectory as a value: poses of the IMU in the map at increasing times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Poses `T_map_imu` at increasing times; between them p is linear and R is slerped.

    Attributes
    ----------
    times : (N,) float64, s since the recording's start, increasing, IMU clock
    positions : (N, 3) float64, m, map frame
    quats_xyzw : (N, 4) float64, unit Hamilton quaternions
    """

    times: NDArray[np.float64]
    positions: NDArray[np.float64]
    quats_xyzw: NDArray[np.float64]

    def __post_init__(self) -> None:
        n = len(self.times)
        if self.positions.shape != (n, 3) or self.quats_xyzw.shape != (n, 4):
            msg = (
                f"trajectory: expected positions ({n}, 3) and quats_xyzw ({n}, 4), "
                f"got {self.positions.shape} and {self.quats_xyzw.shape}"
            )
            raise ValueError(msg)
        if n and not np.all(np.diff(self.times) > 0):
            msg = f"trajectory: times must increase, sample {int(np.argmin(np.diff(self.times))) + 1} does not"
            raise ValueError(msg)
