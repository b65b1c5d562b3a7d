# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a run of the filter has learned of the slow states."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.calibration import STANDARD_GRAVITY
from bentwing.base.mount import FixedMount, MotorMount, Mount, Pose
from bentwing.odometry.continuous.slow_states import INITIAL_STD
from bentwing.odometry.kalman.core import (
    ACCEL_BIAS,
    BASE_ROTATION,
    BASE_TRANSLATION,
    ENCODER_DELAY,
    GRAVITY,
    GYRO_BIAS,
    LATENCY,
    LIDAR_ROTATION,
    LIDAR_TRANSLATION,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing import _core
    from bentwing.base.calibration import Calibration


def calibration_of(
    filter_: _core.KalmanFilter, motor_rate: float, described: Calibration
) -> Calibration:
    """Return the slow states with their standard deviations.

    Parameters
    ----------
    motor_rate : rad/s, at which the motor turns
    described : with which the filter began
    """
    mount = described.mount
    std = np.sqrt(np.maximum(np.diag(filter_.covariance), 0.0))
    named = {
        "latency": std[LATENCY],
        "extrinsic_rotation": std[BASE_ROTATION],
        "extrinsic_translation": std[BASE_TRANSLATION],
        "gyro_bias": std[GYRO_BIAS],
        "accel_bias": std[ACCEL_BIAS],
        "gravity": std[GRAVITY],
        # The filter knows one latency at a time; what is not known of its rate the closing learns.
        "latency_rate": np.array([INITIAL_STD["latency_rate"]]),
    }
    found: Mount = FixedMount(_pose(filter_.base))
    if isinstance(mount, MotorMount):
        # A delay of the encoder is a zero at the rate at which the motor turns.
        zero = mount.encoder_zero - motor_rate * filter_.encoder_delay
        base, lidar = _pose(filter_.base), _pose(filter_.lidar)
        found = replace(mount, T_imu_motor=base, encoder_zero=zero, T_motor_lidar=lidar)
        covariance = filter_.covariance
        named["encoder_zero"] = abs(motor_rate) * std[ENCODER_DELAY]
        named["motor_tilt"] = _across(covariance[LIDAR_ROTATION, LIDAR_ROTATION], mount.axis)
        named["motor_offset"] = _across(
            covariance[LIDAR_TRANSLATION, LIDAR_TRANSLATION], mount.axis
        )
    return replace(
        described,
        latency=filter_.latency,
        mount=found,
        gyro_bias=np.array(filter_.gyro_bias),
        accel_bias=np.array(filter_.accel_bias),
        gravity=np.array([0.0, 0.0, STANDARD_GRAVITY]),
        std={name: values.tolist() for name, values in named.items()},
    )


def _across(covariance: NDArray[np.float64], axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard deviations (2,) across the motor's axis."""
    pair = np.linalg.svd(axis[None])[2][1:]
    return np.asarray(np.sqrt(np.maximum(np.diag(pair @ covariance @ pair.T), 0.0)))


def _pose(transform: tuple[list[float], list[float]]) -> Pose:
    translation, quat = transform
    return Pose(np.array(translation), np.array(quat))
