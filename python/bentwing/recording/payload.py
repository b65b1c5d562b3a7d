# SPDX-License-Identifier: MIT OR Apache-2.0
"""The description of the sensor head: payload.yaml as a frozen, validated value.

Units are metres, radians and seconds; noise values are continuous densities. `T_a_b` takes
coordinates in b to coordinates in a; quaternions are Hamilton, x y z w.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, get_args

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from bentwing.base.arguments import instance
from bentwing.base.errors import PayloadError
from bentwing.base.mount import Pose
from bentwing.base.validation import describe
from bentwing.base.yaml_files import read_yaml
from bentwing.recording.lidar_kinds import KIND_DEFAULTS, LidarKind, VelodyneModel

if TYPE_CHECKING:
    from numpy.typing import NDArray

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Vector = tuple[Finite, Finite, Finite]
Quaternion = tuple[Finite, Finite, Finite, Finite]
Offset = Annotated[float, Field(ge=-0.5, le=0.5, allow_inf_nan=False)]  # s, between two clocks
Angle = Annotated[float, Field(ge=-2 * np.pi, le=2 * np.pi, allow_inf_nan=False)]  # rad
Topic = Annotated[str, Field(min_length=1)]

MAX_LEVER = 10.0  # m; a sensor farther away on the same carrier is a mistake of units
QUATERNION_TOLERANCE = 1e-3  # rounding to three digits is repaired, anything worse is refused


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


def require_lever(value: Vector) -> Vector:
    """Refuse an offset between sensors that no carrier has."""
    distance = float(np.linalg.norm(value))
    if distance > MAX_LEVER:
        msg = f"is {distance:.4g} m long, more than {MAX_LEVER:g} m: give it in metres"
        raise ValueError(msg)
    return value


class Transform(_Section):
    """Rigid transform.

    Attributes
    ----------
    translation : m
    quaternion : x y z w, normalized on entry
    """

    translation: Vector = (0.0, 0.0, 0.0)
    quaternion: Quaternion = (0.0, 0.0, 0.0, 1.0)

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
        """The transform as arrays."""
        return Pose(np.array(self.translation), np.array(self.quaternion))


class Lidar(_Section):
    """The lidar.

    Attributes
    ----------
    topic : None for the only topic of a lidar type in the recording
    kind : decides the defaults of ranges and noise
    model : of a Velodyne, where its raw packets do not identify it
    metadata : JSON file of an Ouster, relative to the payload file, where the recording has none
    min_range, max_range : m, closest and farthest return that is kept; default: by `kind`
    range_sigma : m, one standard deviation of a range; default: by `kind`
    latency : s, its stamps minus the IMU's clock; estimators start from it
    """

    topic: Topic | None = None
    kind: LidarKind = "generic"
    model: VelodyneModel | None = None
    metadata: Annotated[str, Field(min_length=1)] | None = None
    min_range: NonNegative = 0.0
    max_range: Positive = 0.0
    range_sigma: Positive = 0.0
    latency: Offset = 0.0

    @model_validator(mode="before")
    @classmethod
    def _defaults_by_kind(cls, data: Any) -> Any:  # noqa: ANN401 - before validation
        if not isinstance(data, dict):
            return data
        kind = data.get("kind", "generic")
        # An unknown kind is reported by its own field.
        defaults = KIND_DEFAULTS[kind if kind in get_args(LidarKind) else "generic"]
        names = ("min_range", "max_range", "range_sigma")
        return {name: getattr(defaults, name) for name in names} | data

    @field_validator("metadata")
    @classmethod
    def _beside_payload(cls, value: str | None, info: ValidationInfo) -> str | None:
        folder = (info.context or {}).get("folder")
        return value if value is None or folder is None else str(folder / value)

    @model_validator(mode="after")
    def _ordered_ranges(self) -> Lidar:
        if self.min_range >= self.max_range:
            msg = f"min_range {self.min_range:g} m must be below max_range {self.max_range:g} m"
            raise ValueError(msg)
        return self


class Imu(_Section):
    """The IMU.

    Attributes
    ----------
    topic : None for the only Imu topic in the recording
    gyro_noise : rad/s/√Hz, density that includes the vibration
    accel_noise : m/s²/√Hz, density that includes the vibration
    gyro_bias_walk : rad/s²/√Hz
    accel_bias_walk : m/s³/√Hz
    """

    topic: Topic | None = None
    gyro_noise: Positive = 5.0e-4
    accel_noise: Positive = 8.0e-4
    gyro_bias_walk: Positive = 1.0e-5
    accel_bias_walk: Positive = 1.0e-4


class Box(_Section):
    """Axis-aligned box in the lidar frame.

    Attributes
    ----------
    min, max : m, lowest and highest corner x y z
    """

    min: Vector
    max: Vector

    @model_validator(mode="after")
    def _has_volume(self) -> Box:
        if any(low >= high for low, high in zip(self.min, self.max, strict=True)):
            msg = f"min {list(self.min)} must be below max {list(self.max)} on every axis"
            raise ValueError(msg)
        return self


class SelfHit(_Section):
    """A region in the lidar frame where returns are from the carrier itself.

    Attributes
    ----------
    box : the region
    """

    box: Box


class Encoder(_Section):
    """The motor that turns the lidar, whose encoder reads θ.

    `T_imu_lidar(θ) = T_imu_motor · Rot(axis, θ + zero) · T_motor_lidar`

    Attributes
    ----------
    topic : None for the only JointState topic in the recording
    axis : unit vector in the motor frame, normalized on entry
    zero : rad, added to the encoder's angle
    T_imu_motor : pose of the motor in the IMU frame
    T_motor_lidar : pose of the lidar in the frame that the motor turns
    delay : s, at a stamp of the lidar the angle is the encoder's of this much earlier
    """

    topic: Topic | None = None
    axis: Vector = (0.0, 0.0, 1.0)
    zero: Angle = 0.0
    T_imu_motor: Transform = Transform()
    T_motor_lidar: Transform = Transform()
    delay: Offset = 0.0

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


class Gnss(_Section):
    """GNSS fixes (NavSatFix), used only when named.

    Attributes
    ----------
    topic : of the fixes
    lever_arm : m, phase centre of the antenna in the IMU frame
    """

    topic: Topic
    lever_arm: Vector = (0.0, 0.0, 0.0)

    @field_validator("lever_arm")
    @classmethod
    def _plausible_lever(cls, value: Vector) -> Vector:
        return require_lever(value)


class CalibrationRecord(_Section):
    """How well the values above are known, as `bentwing calibrate` writes it; no estimator reads it.

    `std` are standard deviations by name: `motor_tilt` (rad) and `motor_offset` (m) of the lidar on
    the motor, about and along the two directions of `motor_across` (motor frame), `encoder_delay`
    (s), `latency` (s), and of `T_imu_motor` or `T_imu_lidar` `extrinsic_rotation` (rad) and
    `extrinsic_translation` (m).
    """

    std: dict[str, tuple[NonNegative, ...]] = Field(default_factory=dict)
    motor_across: tuple[Vector, Vector] | None = None
    not_observable: tuple[str, ...] = ()


class Payload(_Section):
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
    """

    name: str = "payload"
    lidar: Lidar = Field(default_factory=lambda: Lidar.model_validate({}))
    imu: Imu | None = Field(default_factory=Imu)
    T_imu_lidar: Transform | None = None
    self_hits: tuple[SelfHit, ...] = ()
    encoder: Encoder | None = None
    gnss: Gnss | None = None
    calibration: CalibrationRecord | None = None

    @classmethod
    def default(cls) -> Payload:
        """Return what is assumed without a payload file: a generic lidar, no IMU described."""
        return cls()

    @classmethod
    def load(cls, path: Path | str) -> Payload:
        """Read a payload.yaml.

        Raises
        ------
        PayloadError
            The file cannot be read or is invalid; all problems in one sentence.
        """
        advice = "give the payload.yaml that describes the sensor head"
        data = read_yaml(Path(path), advice, PayloadError)
        if not isinstance(data, dict):
            msg = f"{path}: expected a mapping of sections (lidar, imu, T_imu_lidar, …), found {type(data).__name__}"
            raise PayloadError(msg)
        try:
            return cls.model_validate(data, context={"folder": Path(path).parent})
        except ValidationError as error:
            raise PayloadError(describe(error, cls, path)) from None

    @property
    def describes_imu(self) -> bool:
        """Whether the file says that the head carries an IMU."""
        named = "imu" in self.model_fields_set or self.T_imu_lidar is not None
        return self.imu is not None and named

    @property
    def places_lidar_on_imu(self) -> bool:
        """Whether the lidar's pose in the IMU frame is given, fixed or through the encoder."""
        return self.T_imu_lidar is not None or self.encoder is not None

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
