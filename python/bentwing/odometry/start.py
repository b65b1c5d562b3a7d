# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where a trajectory begins: at rest, in motion, or without an IMU."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.calibration import STANDARD_GRAVITY
from bentwing.base.inertial_unit import InertialUnit
from bentwing.base.log import get_logger
from bentwing.recording.preprocess import find_static_start
from bentwing.recording.preprocess.static_init import level_attitude

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording import ImuBatch
    from bentwing.recording.preprocess import StaticStart
    from bentwing.recording.sections.imu import Imu

_log = get_logger(__name__)

# A start in motion takes its first attitude from the mean force over this time, s: long enough
# for the accelerations of a flight to average out.
MOVING_MEAN = 2.0
# Its first turn is that of the gyro's samples of this time, s.
FIRST_RATE = 0.02
# A motion may begin too softly to be noticed: the last part of a rest is estimated, not held, s.
LATE_HOLD = 0.5


@dataclass(frozen=True, slots=True)
class Start:
    """First pose and biases.

    Attributes
    ----------
    static : what the rest at the start has told, or None
    quat_xyzw : (4,) attitude of the first pose, yaw zero
    rate : (3,) rad/s, of the first pose, imu frame
    gyro_bias, accel_bias : (3,) rad/s, m/s²
    unit : an ideal one, whose reference is the force at the start and whose main axis is the one that
        turns most in the first seconds
    hold : s, the pose stays the first one until this time
    """

    static: StaticStart | None
    quat_xyzw: NDArray[np.float64]
    rate: NDArray[np.float64]
    gyro_bias: NDArray[np.float64]
    accel_bias: NDArray[np.float64]
    unit: InertialUnit
    hold: float


def level_start(time: float) -> Start:
    """Return the start of a recording without IMU: the first pose is the map."""
    level = np.array([0.0, 0.0, 0.0, 1.0])
    nothing = np.zeros(3)
    return Start(None, level, nothing, nothing, nothing, InertialUnit(), time)


def find_start(imu: ImuBatch, noise: Imu, first: float) -> Start:
    """Return the start of a recording with an IMU, from its first seconds.

    Parameters
    ----------
    imu : at least two samples
    first : s, of the first pose
    """
    static = find_static_start(
        imu.times,
        imu.gyro,
        imu.accel,
        gyro_bias_walk=noise.gyro_bias_walk,
        accel_bias_walk=noise.accel_bias_walk,
    )
    if static is None:
        _log.info(
            "no rest within the first %.1f s: the estimate begins in motion", np.ptp(imu.times)
        )
        return _moving_start(imu, first)
    _log.info("the estimate begins after a rest from %.2f to %.2f s", static.start, static.end)
    # Only the part of the bias along gravity shows at rest; the rest is in the attitude.
    force = static.accel_mean
    bias = force * (1.0 - STANDARD_GRAVITY / float(np.linalg.norm(force)))
    hold = max(static.start, static.end - LATE_HOLD)
    unit = _unit(imu, force)
    return Start(static, attitude_of(force), np.zeros(3), static.gyro_bias, bias, unit, hold)


def _moving_start(imu: ImuBatch, first: float) -> Start:
    """Return a start at `first`, s, whose up is the mean force of the time behind it."""
    begin = min(int(np.searchsorted(imu.times, first)), len(imu.times) - 1)
    end = max(begin + 1, int(np.searchsorted(imu.times, first + MOVING_MEAN)))
    times, gyro, accel = imu.times[begin:end], imu.gyro[begin:end], imu.accel[begin:end]
    # A head that nods turns the IMU to all sides within the mean.
    up = geometry.rotate(_turns(times, gyro), accel).mean(axis=0)
    rate = gyro[times < times[0] + FIRST_RATE].mean(axis=0)
    nothing = np.zeros(3)
    return Start(None, attitude_of(up), rate, nothing, nothing, _unit(imu, up), float(imu.times[0]))


def _turns(times: NDArray[np.float64], gyro: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions (N, 4) of the turns since the first of `times`, from rates (N, 3) by trapezoids."""
    steps = geometry.exp(0.5 * np.diff(times)[:, None] * (gyro[1:] + gyro[:-1]))
    turns = [np.array([0.0, 0.0, 0.0, 1.0])]
    for step in steps:
        turns.append(geometry.multiply(turns[-1], step))
    return np.array(turns)


def _unit(imu: ImuBatch, force: NDArray[np.float64]) -> InertialUnit:
    """Return an ideal unit with `force` (3,), m/s², as its reference."""
    turning = (imu.gyro**2).mean(axis=0)
    return InertialUnit(reference=force, main_axis=int(np.argmax(turning)))


def attitude_of(force: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternion (4,) of the attitude, yaw zero, in which `force` (3,) in the IMU frame is up."""
    return geometry.from_matrices(level_attitude(force)[None]).reshape(4)


def levelling(gravity: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternion (4,) that turns the direction of `gravity` (3,) to +z the shortest way."""
    up = gravity / np.linalg.norm(gravity)
    axis = np.cross(up, [0.0, 0.0, 1.0])
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.array([0.0, 0.0, 0.0, 1.0])
    return geometry.exp((axis / sine * np.arctan2(sine, up[2]))[None]).reshape(4)
