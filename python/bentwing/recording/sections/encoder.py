# SPDX-License-Identifier: MIT OR Apache-2.0
"""The section `encoder`."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

import numpy as np
from pydantic import Field, field_validator, model_validator

from bentwing.recording.sections.section import (
    Angle,
    ClockOffset,
    FromTf,
    Offset,
    Section,
    Topic,
    Transform,
    Vector,
)

AngleUnit = Literal["rad", "deg"]
Leans: TypeAlias = tuple[Angle, Angle, Angle, Angle]


class Encoder(Section):
    """The motor that turns the lidar, whose encoder reads θ.

    `T_imu_lidar(θ) = T_imu_motor · Exp(lean(θ)) · Rot(axis, θ + zero + added(θ)) · T_motor_lidar`, with
    `added(θ) = eccentricity · (cos θ, sin θ)` and `lean(θ) = wobble · (cos θ, sin θ, cos 2θ, sin 2θ)`
    about the two directions across the axis.

    Attributes
    ----------
    topic : None for the only JointState topic in the recording
    joint : which joint of the messages it is; None: the first
    from_tf : parent and child of the joint whose motion in /tf is the angle, instead of a JointState
    unit : of the positions in the recording, rad or deg
    sign : 1, or -1 where the positions grow against the turn of `axis`
    clock_offset : s, added to its stamps before all else: for a clock that counts from power-on
    axis : unit vector in the motor frame, normalized on entry
    zero : rad, added to the encoder's angle
    T_imu_motor : pose of the motor in the IMU frame
    T_motor_lidar : pose of the lidar in the frame that the motor turns
    eccentricity : rad, of an encoder whose disc is off its axis
    wobble : rad, of a shaft that leans with its turns; found by `map --write-payload` as the above
    delay : s, at a stamp of the lidar the angle is the encoder's of this much earlier
    """

    topic: Topic | None = None
    joint: Annotated[str, Field(min_length=1)] | None = None
    from_tf: FromTf | None = None
    unit: AngleUnit = "rad"
    sign: Literal[1, -1] = 1
    clock_offset: ClockOffset = 0.0
    axis: Vector = (0.0, 0.0, 1.0)
    zero: Angle = 0.0
    T_imu_motor: Transform = Transform()
    T_motor_lidar: Transform = Transform()
    eccentricity: tuple[Angle, Angle] = (0.0, 0.0)
    wobble: tuple[Leans, Leans] = ((0.0,) * 4, (0.0,) * 4)
    delay: Offset = 0.0

    @property
    def places_motor(self) -> bool:
        """Whether the motor's pose on the IMU, or the lidar's on the motor, is given."""
        return bool(self.model_fields_set & {"T_imu_motor", "T_motor_lidar"})

    @model_validator(mode="after")
    def _one_source(self) -> Encoder:
        if self.from_tf is not None and (self.joint is not None or self.unit != "rad"):
            msg = "from_tf reads the angle from /tf in rad: leave joint and unit out"
            raise ValueError(msg)
        return self

    @field_validator("axis")
    @classmethod
    def _unit_axis(cls, value: Vector) -> Vector:
        norm = float(np.linalg.norm(value))
        if norm < 1e-6:
            msg = f"has length {norm:.3g}: give the direction of the motor's axis"
            raise ValueError(msg)
        if abs(norm - 1.0) < 1e-15:
            return value
        x, y, z = (component / norm for component in value)
        return x, y, z
