# SPDX-License-Identifier: MIT OR Apache-2.0
"""The section `calibration`."""

from __future__ import annotations

from pydantic import Field

from bentwing.recording.sections.section import NonNegative, Section, Vector

STD_UNITS = {
    "motor_tilt": "rad",
    "motor_offset": "m",
    "encoder_delay": "s",
    "encoder_zero": "rad",
    "encoder_eccentricity": "rad",
    "motor_wobble": "rad",
    "latency": "s",
    "extrinsic_rotation": "rad",
    "extrinsic_translation": "m",
    "range_offset": "m",
    "range_grazing": "rad",
}


class CalibrationRecord(Section):
    """How well the values above are known, as `bentwing calibrate` writes it; no estimator reads it.

    `std` are standard deviations by name, in the units of `STD_UNITS`: `motor_tilt` and
    `motor_offset` of the lidar on the motor, about and along the two directions of `motor_across`
    (motor frame), `encoder_delay`, `encoder_zero`, `encoder_eccentricity`, `motor_wobble`, `latency`, of `T_imu_motor` or `T_imu_lidar`
    `extrinsic_rotation` and `extrinsic_translation`, and of `lidar.ranges` `range_offset` and
    `range_grazing`.
    """

    std: dict[str, tuple[NonNegative, ...]] = Field(default_factory=dict)
    motor_across: tuple[Vector, Vector] | None = None
    not_observable: tuple[str, ...] = ()
