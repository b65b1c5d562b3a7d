# SPDX-License-Identifier: MIT OR Apache-2.0
"""From the last registered window to any time up to now, by the IMU."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.base import geometry
from bentwing.base.trajectory import DT
from bentwing.base.transform import from_poses
from bentwing.base.value import Value

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.flight.live.imu_tail import ImuTail
    from bentwing.odometry.interface import Registered

# Beyond the newest data the last measured rate and force are held for at most this long, s.
MAX_EXTRAPOLATION = 0.1
# Inertial samples needed before the one to go on from, s.
OVERLAP = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class StampedPose(Value):
    """Pose of the IMU in the map at a time.

    Attributes
    ----------
    time : s, IMU clock
    position : (3,) float64, m, map frame
    quat_xyzw : (4,) float64, unit
    velocity : (3,) float64, m/s, map frame
    predicted : s, how long before `time` the last registered lidar data is; 0 for a pose that the
        lidar has seen
    """

    time: float
    position: NDArray[np.float64]
    quat_xyzw: NDArray[np.float64]
    velocity: NDArray[np.float64]
    predicted: float

    @property
    def T_map_imu(self) -> NDArray[np.float64]:
        """(4, 4) float64, homogeneous."""
        return from_poses(self.position, self.quat_xyzw)


class Prediction:
    """Carries the end of a pass on, with its biases and gravity, as the estimator would.

    Not for several threads at once.
    """

    def __init__(self, registered: Registered) -> None:
        self.recent = registered.recent()
        self.registered_until = registered.end - registered.globals.latency_at(registered.end)
        self._slow = registered.globals.levelled()
        # With inertial samples behind all of them, so that going on from here is final.
        self._carried = _core.Samples(
            float(self.recent.times[-2]),
            DT,
            self.recent.positions[-2:],
            self.recent.quats_xyzw[-2:],
        )

    @property
    def start(self) -> float:
        """Time of the oldest pose, s."""
        return float(self.recent.times[0])

    def pose(self, at: float, imu: ImuTail) -> StampedPose:
        """Return the pose at a time from `start` on; without inertial samples at constant velocity."""
        recent = self.recent
        if at <= recent.times[-1]:
            times, positions, quats = recent.times, recent.positions, recent.quats_xyzw
        else:
            ahead = self._carried_to(at, imu)
            positions, quats = ahead.positions, ahead.quats_xyzw
            times = ahead.start + DT * np.arange(len(positions), dtype=np.float64)
        i = min(max(int((at - times[0]) / DT), 0), len(times) - 2)
        share = np.asarray((at - times[i]) / DT)
        return StampedPose(
            at,
            positions[i] + share * (positions[i + 1] - positions[i]),
            geometry.slerp(quats[i], quats[i + 1], share),
            (positions[i + 1] - positions[i]) / DT,
            max(0.0, at - self.registered_until),
        )

    def _carried_to(self, at: float, imu: ImuTail) -> _core.Samples:
        batch = imu.since(self._carried.end - OVERLAP)
        if not len(batch.times):
            return self._carried.extended(None, self._slow, at + DT)[0]
        times, gyro, accel = batch.times, batch.gyro, batch.accel
        if imu.end > self._carried.end + DT:
            real = _core.Imu(times, gyro, accel)
            # Just below the last stamp: a sample at it could be beyond by rounding.
            self._carried, _ = self._carried.extended(real, self._slow, imu.end - 2e-9)
        if at <= self._carried.end:
            return self._carried
        missing = max(at - imu.end, 0.0) + 2 * DT
        n = int(missing / (0.5 * DT)) + 1
        times = np.concatenate([times, times[-1] + 0.5 * DT * np.arange(1, n + 1)])
        held = _core.Imu(
            times,
            np.concatenate([gyro, np.repeat(gyro[-1:], n, axis=0)]),
            np.concatenate([accel, np.repeat(accel[-1:], n, axis=0)]),
        )
        return self._carried.extended(held, self._slow, at + DT)[0]


def past_pose(trajectory: Trajectory, at: float) -> StampedPose:
    """Return the pose at a time within the registered trajectory."""
    first = float(trajectory.times[0])
    if not at >= first:
        msg = f"at: {at:.3f} s is before the first pose at {first:.3f} s"
        raise ValueError(msg)
    positions, quats = trajectory.interpolate(np.array([at]))
    i = min(int((at - first) / DT), len(trajectory.times) - 2)
    velocity = (trajectory.positions[i + 1] - trajectory.positions[i]) / DT
    return StampedPose(at, positions[0], quats[0], velocity, 0.0)
