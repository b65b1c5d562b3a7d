# SPDX-License-Identifier: MIT OR Apache-2.0
"""The section `gnss`."""

from __future__ import annotations

from pydantic import Field, field_validator, model_validator

from bentwing.recording.sections.section import Lever, Section, Topic, Vector, require_lever


class Gnss(Section):
    """GNSS receiver; its fixes (NavSatFix, GPSFix) are used only when named.

    Attributes
    ----------
    topic : of the fixes; None where they are in a file
    lever_arm : m, phase centre of the antenna in the IMU frame
    lever_arm_std : m, by which it may be off along each axis; the fixes say where the antenna is then
    """

    topic: Topic | None = None
    lever_arm: Lever = (0.0, 0.0, 0.0)
    lever_arm_std: float = Field(default=0.0, ge=0.0, le=2.0)

    @field_validator("lever_arm")
    @classmethod
    def _plausible_lever(cls, value: Vector) -> Vector:
        return require_lever(value)

    @model_validator(mode="after")
    def _says_something(self) -> Gnss:
        if not self.model_fields_set:
            msg = "says nothing; give the topic of the fixes, or the lever_arm for fixes in a file"
            raise ValueError(msg)
        return self
