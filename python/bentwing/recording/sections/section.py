# SPDX-License-Identifier: MIT OR Apache-2.0
"""What all sections of payload.yaml have in common: their base, their numbers, and transforms."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    ValidationInfo,
    field_validator,
    model_serializer,
    model_validator,
)

from bentwing.base.errors import PayloadError
from bentwing.base.mount import Pose
from bentwing.base.units import Unit
from bentwing.recording.link_chain import QUATERNION_TOLERANCE
from bentwing.recording.sections.transform_forms import OTHER_FORMS, as_quaternion

Finite = Annotated[float, Field(allow_inf_nan=False)]
MOST = 1e9  # of any quantity of a head in its unit; beyond it squares and products end
Positive = Annotated[float, Field(gt=0, le=MOST, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, le=MOST, allow_inf_nan=False)]
Vector = tuple[Finite, Finite, Finite]
Quaternion = tuple[Finite, Finite, Finite, Finite]
Offset = Annotated[float, Field(ge=-1.5, le=1.5, allow_inf_nan=False), Unit("s")]
# Between a clock that counts from anywhere and the epoch; beyond it int64 nanoseconds end.
ClockOffset = Annotated[float, Field(ge=-4e9, le=4e9, allow_inf_nan=False), Unit("s")]
Angle = Annotated[float, Field(ge=-2 * np.pi, le=2 * np.pi, allow_inf_nan=False), Unit("rad")]
Lever = Annotated[Vector, Unit("m")]
Topic = Annotated[str, Field(min_length=1)]

MAX_LEVER = 10.0  # m; a sensor farther away on the same carrier is a mistake of units


class Section(BaseModel):
    """A part of payload.yaml: frozen, and without keys that it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    also_accepted: ClassVar[tuple[str, ...]] = ()
    """Keys that a file may give and that are turned into fields on entry."""

    def differing(self) -> dict[str, Any]:
        """Return the fields that differ from their defaults, and the sections that were given."""
        fields = type(self).model_fields
        return {
            name: value
            for name, value in self
            if value != fields[name].get_default(call_default_factory=True)
            or (name in self.model_fields_set and isinstance(value, Section))
        }


def require_lever(value: Vector) -> Vector:
    """Refuse an offset between sensors that no carrier has."""
    distance = float(np.linalg.norm(value))
    if distance > MAX_LEVER:
        msg = f"is {distance:.4g} m long, more than {MAX_LEVER:g} m: give it in metres"
        raise ValueError(msg)
    return value


class FromTf(Section):
    """Two frames of the recording's /tf_static, named as there."""

    parent: Topic
    child: Topic


class Transform(Section):
    """Rigid transform; `transform_forms` has the other ways in which a file may give its rotation.

    Attributes
    ----------
    translation : m
    quaternion : x y z w, normalized on entry
    from_tf : where to read both from; None once a recording has told them
    """

    also_accepted: ClassVar[tuple[str, ...]] = OTHER_FORMS
    translation: Lever = (0.0, 0.0, 0.0)
    quaternion: Annotated[Quaternion, Unit("x y z w")] = (0.0, 0.0, 0.0, 1.0)
    from_tf: FromTf | None = None

    @model_validator(mode="before")
    @classmethod
    def _of_any_form(cls, given: Any, info: ValidationInfo) -> Any:  # noqa: ANN401 - whatever the file holds
        folder = (info.context or {}).get("folder", Path())
        return as_quaternion(given, folder) if isinstance(given, dict) else given

    @model_serializer(mode="wrap")
    def _as_given(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = handler(self)
        reference = values.pop("from_tf", None)  # which may be left out already
        return values if reference is None else {"from_tf": reference}

    @field_validator("translation")
    @classmethod
    def _plausible_lever(cls, value: Vector) -> Vector:
        return require_lever(value)

    @field_validator("quaternion")
    @classmethod
    def _normalized(cls, value: Quaternion) -> Quaternion:
        norm = float(np.linalg.norm(value))
        if not abs(norm - 1.0) <= QUATERNION_TOLERANCE:
            msg = f"has norm {norm:.4g}, expected 1: give a unit quaternion in the order x y z w"
            raise ValueError(msg)
        # Leave quaternions that are unit up to rounding alone, so that a payload written out and
        # read again is the same value.
        if abs(norm - 1.0) < 1e-15:
            return value
        x, y, z, w = (component / norm for component in value)
        return x, y, z, w

    @property
    def pose(self) -> Pose:
        """The transform as arrays.

        Raises
        ------
        PayloadError
            Only a recording can tell it.
        """
        if self.from_tf is not None:
            msg = (
                f"the pose of {self.from_tf.child} in {self.from_tf.parent} is in the /tf_static of a "
                "recording, and here is none: give translation and quaternion instead of from_tf"
            )
            raise PayloadError(msg)
        return Pose(np.array(self.translation), np.array(self.quaternion))
