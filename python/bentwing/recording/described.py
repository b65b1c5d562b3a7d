# SPDX-License-Identifier: MIT OR Apache-2.0
"""The calibration that a payload describes: where every estimator begins."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.calibration import STANDARD_GRAVITY, Calibration
from bentwing.base.mount import FixedMount, MotorErrors, MotorMount, Pose
from bentwing.base.range_bias import RangeBias

if TYPE_CHECKING:
    from bentwing.base.mount import Mount
    from bentwing.recording.payload import Payload


def described_mount(payload: Payload) -> Mount:
    """Return the mount as the payload describes it; without a description the frames coincide."""
    encoder = payload.encoder
    if encoder is None:
        fixed = payload.T_imu_lidar
        return FixedMount(Pose.identity() if fixed is None else fixed.pose)
    return MotorMount(
        T_imu_motor=encoder.T_imu_motor.pose,
        axis=np.array(encoder.axis),
        encoder_zero=encoder.zero,
        T_motor_lidar=encoder.T_motor_lidar.pose,
        errors=MotorErrors(np.array(encoder.eccentricity), np.array(encoder.wobble)),
    )


def described_calibration(payload: Payload) -> Calibration:
    """Return latency, mount and ranges as the payload describes them, no biases, gravity along z.

    A large latency is taken off the stamps when they are read, so that no estimator meets it.
    """
    ranges = payload.lidar.ranges
    return Calibration(
        latency=payload.lidar.latency_left,
        mount=described_mount(payload),
        gyro_bias=np.zeros(3),
        accel_bias=np.zeros(3),
        gravity=np.array([0.0, 0.0, STANDARD_GRAVITY]),
        latency_read=payload.lidar.latency_read,
        ranges=RangeBias() if ranges is None else ranges.bias,
    )
