# SPDX-License-Identifier: MIT OR Apache-2.0
"""How the lidar is mounted on the IMU: fixed, or turned by a motor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Pose:
    """Pose of a frame in another: coordinates x become `R x + translation`.

    Attributes
    ----------
    translation : (3,) float64, m
    quat_xyzw : (4,) float64, unit
    """

    translation: NDArray[np.float64]
    quat_xyzw: NDArray[np.float64]

    @classmethod
    def identity(cls) -> Pose:
        """Return the pose of a frame in itself."""
        return cls(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))

    @property
    def matrix(self) -> NDArray[np.float64]:
        """(3, 3) the rotation R."""
        return geometry.to_matrices(self.quat_xyzw)


@dataclass(frozen=True, slots=True)
class FixedMount:
    """A lidar that is fixed to the IMU."""

    T_imu_lidar: Pose


@dataclass(frozen=True, slots=True)
class MotorMount:
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


Mount = FixedMount | MotorMount
