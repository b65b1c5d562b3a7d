# SPDX-License-Identifier: MIT OR Apache-2.0
"""The section `imu`."""

from __future__ import annotations

from typing import Annotated, Literal, get_args

from pydantic import BeforeValidator, field_validator

from bentwing.base.units import Unit
from bentwing.recording.sections.imu_errors import WARMING, ImuErrors, ImuKind, expected_errors
from bentwing.recording.sections.section import ClockOffset, Positive, Section, Topic

Axis = Literal["x", "-x", "y", "-y", "z", "-z"]
Axes = tuple[Axis, Axis, Axis]
AccelUnit = Literal["m/s2", "g", "milli-g", "cm/s2"]
GyroUnit = Literal["rad/s", "deg/s"]
AS_GIVEN: Axes = ("x", "y", "z")


def _plain(value: object) -> object:
    """Read the square of m/s² in any spelling."""
    return value.replace("²", "2").replace("^2", "2") if isinstance(value, str) else value


class ImuUnits(Section):
    """The units of the samples in the recording.

    Attributes
    ----------
    accel : m/s2, g, milli-g or cm/s2
    gyro : rad/s or deg/s
    """

    accel: Annotated[AccelUnit, BeforeValidator(_plain)] = "m/s2"
    gyro: GyroUnit = "rad/s"


class Imu(Section):
    """The IMU.

    Attributes
    ----------
    topic : None for the only Imu topic in the recording
    gyro_noise : rad/s/√Hz, density that includes the vibration
    accel_noise : m/s²/√Hz, density that includes the vibration
    gyro_bias_walk : rad/s²/√Hz
    accel_bias_walk : m/s³/√Hz
    kind : how good it is; a better one than `consumer` helps where the motion shows little
    errors : figures of its own, where they are known
    axes : which signed axis of the samples each axis x y z of the imu frame is
    gyro_axes : the same of the gyro alone; None: as `axes`
    units : of the samples
    clock_offset : s, added to its stamps before all else: for a clock that counts from power-on
    """

    topic: Topic | None = None
    gyro_noise: Annotated[Positive, Unit("rad/s/√Hz")] = 5.0e-4
    accel_noise: Annotated[Positive, Unit("m/s²/√Hz")] = 8.0e-4
    gyro_bias_walk: Annotated[Positive, Unit("rad/s²/√Hz")] = 1.0e-5
    accel_bias_walk: Annotated[Positive, Unit("m/s³/√Hz")] = 1.0e-4
    kind: ImuKind = "consumer"
    errors: ImuErrors = ImuErrors()
    axes: Axes = AS_GIVEN
    gyro_axes: Axes | None = None
    units: ImuUnits = ImuUnits()
    clock_offset: ClockOffset = 0.0

    @property
    def errors_expected(self) -> dict[str, float]:
        """Standard deviations of scales, misalignments and g-sensitivity, by name."""
        return expected_errors(self.kind, self.errors)

    @property
    def gyro_walk_expected(self) -> float:
        """Random walk of the gyro's bias with its change by temperature, rad/s²/√Hz."""
        return max(self.gyro_bias_walk, WARMING[self.kind])

    @field_validator("axes", "gyro_axes")
    @classmethod
    def _each_axis_once(cls, value: Axes | None) -> Axes | None:
        if value is not None and {axis[-1] for axis in value} != set("xyz"):
            msg = (
                f"[{', '.join(value)}] does not name each of x, y and z once: give the axis of the "
                f"samples for each axis of the imu frame, with its sign, out of {', '.join(get_args(Axis))}"
            )
            raise ValueError(msg)
        return value
