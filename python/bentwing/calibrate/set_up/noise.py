# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a payload says of the noise of its IMU."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.calibrate.set_up import edits
from bentwing.recording.sections.imu import Imu

if TYPE_CHECKING:
    from bentwing.odometry.imu_noise import ImuNoise
    from bentwing.recording import Payload

_STATED = frozenset({"gyro_noise", "accel_noise"})


def with_at_least(payload: Payload, noise: ImuNoise) -> Payload:
    """Return the payload with no less noise than this."""
    imu = payload.imu or Imu()
    gyro, accel = max(imu.gyro_noise, noise.gyro), max(imu.accel_noise, noise.accel)
    return edits.with_imu(payload, gyro_noise=gyro, accel_noise=accel)


def states_noise(payload: Payload) -> bool:
    """Whether a payload says how noisy its IMU is."""
    return payload.imu is not None and bool(payload.imu.model_fields_set & _STATED)
