# SPDX-License-Identifier: MIT OR Apache-2.0
"""The description of the sensor head: payload.yaml as a frozen, validated value.

Units are metres, radians and seconds; noise values are continuous densities. `T_a_b` takes
coordinates in b to coordinates in a; quaternions are Hamilton, x y z w. `sections` has the sections.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from pydantic import Field, ValidationError

from bentwing.base.arguments import instance
from bentwing.base.atomic import write_text
from bentwing.base.errors import PayloadError
from bentwing.base.validation import describe
from bentwing.base.yaml_files import read_yaml
from bentwing.recording.payload_text import payload_text
from bentwing.recording.ready import payload_path
from bentwing.recording.sections.calibration import CalibrationRecord
from bentwing.recording.sections.encoder import Encoder
from bentwing.recording.sections.gnss import Gnss
from bentwing.recording.sections.imu import Imu
from bentwing.recording.sections.lidar import Lidar
from bentwing.recording.sections.project import Project
from bentwing.recording.sections.section import Section, Transform
from bentwing.recording.sections.self_hits import SelfHit

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Payload(Section):
    """The sensor head.

    Attributes
    ----------
    name : of the head
    lidar, imu : the sensors; `imu: null` in the file says that the recording's IMU is not to be used
    T_imu_lidar : pose of the lidar in the IMU frame, of a head without encoder
    self_hits : regions where returns are from the carrier
    encoder : the motor that turns the lidar, if there is one
    gnss : the receiver, if its fixes are to be used
    calibration : what `bentwing calibrate` has found out about the values above
    project : what the report says of the job
    """

    name: str = "payload"
    lidar: Lidar = Field(default_factory=lambda: Lidar.model_validate({}))
    imu: Imu | None = Field(default_factory=Imu)
    T_imu_lidar: Transform | None = None
    self_hits: tuple[SelfHit, ...] = ()
    encoder: Encoder | None = None
    gnss: Gnss | None = None
    calibration: CalibrationRecord | None = None
    project: Project | None = None

    @classmethod
    def default(cls) -> Payload:
        """Return what is assumed without a payload file: a generic lidar, no IMU described."""
        return cls()

    @classmethod
    def load(cls, path: Path | str) -> Payload:
        """Read a payload.yaml, or one that comes with bentwing, as `dataset:NAME`.

        Raises
        ------
        PayloadError
            The file cannot be read or is invalid; all problems in one sentence.
        """
        advice = "give the payload.yaml that describes the sensor head"
        path = payload_path(path)
        data = read_yaml(path, advice, PayloadError)
        if not isinstance(data, dict):
            msg = f"{path}: expected a mapping of sections (lidar, imu, T_imu_lidar, …), found {type(data).__name__}"
            raise PayloadError(msg)
        try:
            return cls.model_validate(data, context={"folder": path.parent})
        except ValidationError as error:
            raise PayloadError(describe(error, cls, path)) from None

    def to_yaml(self) -> str:
        """Return what `load` reads as the same head: what differs from the defaults, with units."""
        return payload_text(self)

    def save(self, path: Path | str) -> None:
        """Write a payload.yaml as a whole or not at all; files that it names are found from there."""
        file, named = Path(path), self.lidar.metadata
        if named is not None and not Path(named).is_absolute():
            beside = os.path.relpath(named, file.parent)
            lidar = self.lidar.model_copy(update={"metadata": beside})
            write_text(file, self.model_copy(update={"lidar": lidar}).to_yaml())
            return
        write_text(file, self.to_yaml())

    def carrying(self, attributes: tuple[str, ...]) -> Payload:
        """Return the same head with these further fields of the lidar's points carried to the map.

        Raises
        ------
        PayloadError
            If a name is empty or there twice.
        """
        try:
            lidar = Lidar.model_validate({**dict(self.lidar), "attributes": attributes})
        except ValidationError as error:
            raise PayloadError(describe(error, Lidar, "lidar")) from None
        return self.model_copy(update={"lidar": lidar})

    @property
    def describes_imu(self) -> bool:
        """Whether the file says that the head carries an IMU."""
        named = "imu" in self.model_fields_set or self.T_imu_lidar is not None
        return self.imu is not None and named

    @property
    def places_lidar_on_imu(self) -> bool:
        """Whether the lidar's pose in the IMU frame is given, fixed or through the encoder."""
        return self.T_imu_lidar is not None or (
            self.encoder is not None and self.encoder.places_motor
        )

    @property
    def refers_to_recording(self) -> bool:
        """Whether a transform is to be read from the /tf_static of a recording."""
        encoder = self.encoder
        of_motor = [] if encoder is None else [encoder.T_imu_motor, encoder.T_motor_lidar]
        given = [one for one in (self.T_imu_lidar, *of_motor) if one is not None]
        return any(one.from_tf is not None for one in given)

    def T_imu_lidar_matrix(self) -> NDArray[np.float64]:
        """(4, 4) of the fixed mount; the identity where none is given (no IMU)."""
        return np.eye(4) if self.T_imu_lidar is None else self.T_imu_lidar.pose.matrix


PayloadLike: TypeAlias = Payload | Path | str | None
"""A sensor head, the payload.yaml that describes it, or None for `Payload.default`."""


def as_payload(value: PayloadLike) -> Payload:
    """Return the sensor head, from its file if need be.

    Raises
    ------
    TypeError, PayloadError
        If it is of another type, or its file is invalid.
    """
    if value is None:
        return Payload.default()
    if isinstance(value, (str, Path)):
        return Payload.load(value)
    return instance(
        "payload", value, Payload, "give the path of a payload.yaml, a Payload, or None"
    )
