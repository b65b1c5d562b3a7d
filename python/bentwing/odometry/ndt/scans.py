# SPDX-License-Identifier: MIT OR Apache-2.0
"""Scans: the returns of a fixed length of time, and what they are when the motion is taken out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.base import geometry
from bentwing.base.mount import FixedMount, Mount, Pose

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.odometry.buffer import LidarStretch
    from bentwing.odometry.ndt.motion import Twist

# Between these the motion is straight, s.
STEP = 0.01


@dataclass(frozen=True, slots=True)
class Scan:
    """The returns of a fixed length of time.

    Attributes
    ----------
    points : (N, 3) float64, m, lidar frame
    times : (N,) float64, s, lidar clock, non-decreasing
    angles : (N,) float64 or None, rad, encoder angle at each point
    time : s, IMU clock, of the mean of `times`: the pose of the scan is that of this time
    """

    points: NDArray[np.float64]
    times: NDArray[np.float64]
    angles: NDArray[np.float64] | None
    time: float

    @classmethod
    def of(cls, returns: LidarStretch, latency: float) -> Scan:
        """Make a scan of at least one return, whose stamps are late by `latency`, s."""
        time = float(returns.times.mean()) - latency
        return cls(returns.points, returns.times, returns.angles, time)

    def some(self, chosen: NDArray[np.intp]) -> Scan:
        """Return the scan with some of its points, its time unchanged."""
        angles = None if self.angles is None else self.angles[chosen]
        return Scan(self.points[chosen], self.times[chosen], angles, self.time)

    def placed(self, twist: Twist, head: _core.Globals, threads: int) -> NDArray[np.float64]:
        """Points (N, 3), m, in the IMU frame at the scan's time, if the twist holds all along.

        Every point is turned by the encoder's angle of its own time (Tazir 2020, eqs. 4 to 6).
        """
        start = float(self.times[0]) - head.latency - STEP
        n = int((float(self.times[-1]) - head.latency - start) / STEP) + 2
        since = start + STEP * np.arange(n) - self.time
        motion = _core.Samples(
            start, STEP, since[:, None] * twist.v, geometry.exp(since[:, None] * twist.omega)
        )
        return motion.place(self.points, self.times, self.angles, head, threads=threads)

    def lidar_at(self, pose: Pose, mount: Mount) -> Pose:
        """Pose of the lidar at the scan's time, given that of the IMU."""
        if isinstance(mount, FixedMount):
            return pose @ mount.T_imu_lidar
        return pose @ mount.lidar_at(0.0 if self.angles is None else float(self.angles.mean()))
