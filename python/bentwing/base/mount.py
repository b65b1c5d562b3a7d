# SPDX-License-Identifier: MIT OR Apache-2.0
"""How the lidar is mounted on the IMU: fixed, or turned by a motor.

As JSON a mount is what payload.yaml has at its top level, `T_imu_lidar` or `encoder`, so that it can
be pasted from the one to the other.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry, transform
from bentwing.base.value import Value

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Pose(Value):
    """Pose of a frame in another: coordinates x become `R x + translation`.

    Attributes
    ----------
    translation : (3,) float64, m
    quaternion : (4,) float64, x y z w, unit
    """

    translation: NDArray[np.float64]
    quaternion: NDArray[np.float64]

    @classmethod
    def identity(cls) -> Pose:
        """Return the pose of a frame in itself."""
        return cls(np.zeros(3), np.array(geometry.IDENTITY_QUAT_XYZW))

    @property
    def R(self) -> NDArray[np.float64]:
        """(3, 3) the rotation."""
        return geometry.to_matrices(self.quaternion)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """(4, 4) homogeneous."""
        return transform.from_poses(self.translation, self.quaternion)

    def __matmul__(self, behind: Pose) -> Pose:
        """`T_a_b @ T_b_c` is `T_a_c`."""
        return Pose(
            geometry.compose(self.translation, self.quaternion, behind.translation),
            geometry.multiply(self.quaternion, behind.quaternion),
        )

    def to_json(self) -> dict[str, Any]:
        """Return the pose as payload.yaml has it."""
        return {
            "translation": self.translation.tolist(),
            "quaternion": self.quaternion.tolist(),
        }

    @classmethod
    def from_json(cls, described: Mapping[str, Any]) -> Pose:
        """Read what `to_json` wrote; earlier run.json call the quaternion `quat_xyzw`."""
        quaternion = described["quaternion" if "quaternion" in described else "quat_xyzw"]
        return cls(np.array(described["translation"], float), np.array(quaternion, float))


@dataclass(frozen=True, slots=True, eq=False)
class FixedMount(Value):
    """A lidar that is fixed to the IMU."""

    T_imu_lidar: Pose

    def to_json(self) -> dict[str, Any]:
        """Return the mount as payload.yaml has it."""
        return {"T_imu_lidar": self.T_imu_lidar.to_json()}


@dataclass(frozen=True, slots=True, eq=False)
class MotorErrors(Value):
    """How a motor turns otherwise than its encoder reads, by the angle θ that it reads.

    Attributes
    ----------
    eccentricity : (2,) rad; `eccentricity · (cos θ, sin θ)` is added to the angle: the encoder's disc is
        off its axis
    wobble : (2, 4) rad; `wobble · (cos θ, sin θ, cos 2θ, sin 2θ)` is how far the shaft leans about the
        two axes across it, motor frame
    """

    eccentricity: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    wobble: NDArray[np.float64] = field(default_factory=lambda: np.zeros((2, 4)))

    def added(self, angles: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what the eccentricity adds to angles (N,), rad."""
        return np.asarray(_harmonics(angles)[..., :2] @ self.eccentricity)

    def lean(self, axis: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
        """Return how the shaft leans (3,), a rotation vector, rad, motor frame."""
        return np.asarray(
            _harmonics(np.array(angle)) @ self.wobble.T @ geometry.orthogonal_pair(axis)
        )

    def to_json(self) -> dict[str, Any]:
        """Return the errors as payload.yaml has them; nothing where there are none."""
        named = {"eccentricity": self.eccentricity, "wobble": self.wobble}
        return {name: values.tolist() for name, values in named.items() if values.any()}

    @classmethod
    def from_json(cls, encoder: Mapping[str, Any]) -> MotorErrors:
        """Read what `to_json` wrote."""
        named = ("eccentricity", "wobble")
        return cls(**{name: np.array(encoder[name], float) for name in named if name in encoder})


@dataclass(frozen=True, slots=True, eq=False)
class MotorMount(Value):
    """A lidar turned by a motor, whose encoder reads θ.

    `T_imu_lidar(θ) = T_imu_motor · Exp(lean(θ)) · Rot(axis, θ + encoder_zero + added(θ)) · T_motor_lidar`,
    with what `errors` say of θ.

    Attributes
    ----------
    T_imu_motor : the motor in the IMU frame
    axis : (3,) float64, unit, motor frame
    encoder_zero : rad
    T_motor_lidar : the lidar in the rotating motor frame
    errors : how it turns otherwise than its encoder reads
    """

    T_imu_motor: Pose
    axis: NDArray[np.float64]
    encoder_zero: float
    T_motor_lidar: Pose
    errors: MotorErrors = field(default_factory=MotorErrors)

    def lidar_at(self, angle: float) -> Pose:
        """Return `T_imu_lidar` where the encoder reads `angle`, rad."""
        turned = angle + self.encoder_zero + float(self.errors.added(np.array(angle)))
        lean = Pose(np.zeros(3), geometry.exp(self.errors.lean(self.axis, angle)))
        return self.T_imu_motor @ lean @ self._turn(turned) @ self.T_motor_lidar

    def with_zero_behind_motor(self) -> MotorMount:
        """Return the same mount with the encoder's zero as a turn of the lidar about the axis."""
        if self.encoder_zero == 0.0:
            return self
        behind = self._turn(self.encoder_zero) @ self.T_motor_lidar
        return replace(self, encoder_zero=0.0, T_motor_lidar=behind)

    def to_json(self) -> dict[str, Any]:
        """Return the mount as payload.yaml has it."""
        encoder = {
            "axis": self.axis.tolist(),
            "zero": float(self.encoder_zero),
            "T_imu_motor": self.T_imu_motor.to_json(),
            "T_motor_lidar": self.T_motor_lidar.to_json(),
            **self.errors.to_json(),
        }
        return {"encoder": encoder}

    def _turn(self, angle: float) -> Pose:
        return Pose(np.zeros(3), geometry.exp(angle * self.axis))


Mount = FixedMount | MotorMount


def mount_from_json(described: Mapping[str, Any]) -> Mount:
    """Read what `to_json` of a mount wrote; earlier run.json have the parts of a motor side by side."""
    if "T_imu_lidar" in described:
        return FixedMount(Pose.from_json(described["T_imu_lidar"]))
    encoder = described.get("encoder", described)
    return MotorMount(
        Pose.from_json(encoder["T_imu_motor"]),
        np.array(encoder["axis"], float),
        encoder["zero" if "zero" in encoder else "encoder_zero"],
        Pose.from_json(encoder["T_motor_lidar"]),
        MotorErrors.from_json(encoder),
    )


def _harmonics(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cosine and sine of angles, and of twice the angles (..., 4)."""
    return np.stack(
        [np.cos(angles), np.sin(angles), np.cos(2 * angles), np.sin(2 * angles)], axis=-1
    )
