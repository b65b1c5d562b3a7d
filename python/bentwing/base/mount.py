# SPDX-License-Identifier: MIT OR Apache-2.0
"""How the lidar is mounted on the IMU: fixed, or turned by a motor.

As JSON a mount is what payload.yaml has at its top level, `T_imu_lidar` or `encoder`, so that it can
be pasted from the one to the other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
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
class MotorMount(Value):
    """A lidar turned by a motor, whose encoder reads θ.

    `T_imu_lidar(θ) = T_imu_motor · Rot(axis, θ + encoder_zero) · T_motor_lidar`

    Attributes
    ----------
    T_imu_motor : the motor in the IMU frame
    axis : (3,) float64, unit, motor frame
    encoder_zero : rad
    T_motor_lidar : the lidar in the rotating motor frame
    """

    T_imu_motor: Pose
    axis: NDArray[np.float64]
    encoder_zero: float
    T_motor_lidar: Pose

    def lidar_at(self, angle: float) -> Pose:
        """Return `T_imu_lidar` where the encoder reads `angle`, rad."""
        return self.T_imu_motor @ self._turn(angle + self.encoder_zero) @ self.T_motor_lidar

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
    )
