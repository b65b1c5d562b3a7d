# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a recording is read into: batches of samples in time order."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class LidarBatch:
    """Consecutive returns of the lidar.

    Attributes
    ----------
    points : (N, 3) float64, m, lidar frame
    times : (N,) float64, s since the recording's start, non-decreasing, lidar clock
    intensity : (N,) float32 or None, as the sensor reports it
    ring : (N,) uint16 or None, beam number of a multi-beam lidar
    angles : (N,) float64 or None, rad, angle of the motor that turns the lidar at each point's
        time, unwrapped; set by preprocess
    """

    points: NDArray[np.float64]
    times: NDArray[np.float64]
    intensity: NDArray[np.float32] | None = None
    ring: NDArray[np.uint16] | None = None
    angles: NDArray[np.float64] | None = None

    def where(self, keep: NDArray[np.bool_] | NDArray[np.intp] | slice) -> LidarBatch:
        """Return the returns selected by a mask, by indices or by a slice."""
        intensity, ring, angles = self.intensity, self.ring, self.angles
        return LidarBatch(
            self.points[keep],
            self.times[keep],
            None if intensity is None else intensity[keep],
            None if ring is None else ring[keep],
            None if angles is None else angles[keep],
        )


@dataclass(frozen=True, slots=True)
class ImuBatch:
    """Consecutive inertial samples.

    Attributes
    ----------
    times : (M,) float64, s since the recording's start, increasing, IMU clock
    gyro : (M, 3) float64, rad/s, imu frame
    accel : (M, 3) float64, m/s², imu frame (specific force: +g upwards at rest)
    """

    times: NDArray[np.float64]
    gyro: NDArray[np.float64]
    accel: NDArray[np.float64]

    def where(self, keep: NDArray[np.bool_] | NDArray[np.intp] | slice) -> ImuBatch:
        """Return the samples selected by a mask, by indices or by a slice."""
        return ImuBatch(self.times[keep], self.gyro[keep], self.accel[keep])


@dataclass(frozen=True, slots=True)
class EncoderBatch:
    """Consecutive angles of the motor that turns the lidar.

    Attributes
    ----------
    times : (K,) float64, s since the recording's start, increasing
    angles : (K,) float64, rad, unwrapped (continuous over full turns, also between batches)
    """

    times: NDArray[np.float64]
    angles: NDArray[np.float64]


Batch = LidarBatch | ImuBatch | EncoderBatch
