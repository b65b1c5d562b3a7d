# SPDX-License-Identifier: MIT OR Apache-2.0
"""The section `calibration`."""

from __future__ import annotations

from pydantic import Field

from bentwing.recording.sections.section import NonNegative, Section, Vector


class CalibrationRecord(Section):
    """How well the values above are known, as `bentwing calibrate` writes it; no estimator reads it.

    `std` are standard deviations by name: `motor_tilt` (rad) and `motor_offset` (m) of the lidar on
    the motor, about and along the two directions of `motor_across` (motor frame), `encoder_delay`
    (s), `latency` (s), and of `T_imu_motor` or `T_imu_lidar` `extrinsic_rotation` (rad) and
    `extrinsic_translation` (m).
    """

    std: dict[str, tuple[NonNegative, ...]] = Field(default_factory=dict)
    motor_across: tuple[Vector, Vector] | None = None
    not_observable: tuple[str, ...] = ()
