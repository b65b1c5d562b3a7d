# SPDX-License-Identifier: MIT OR Apache-2.0
"""How the lidar is mounted on the IMU: fixed, or turned by a motor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing import geometry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording import Payload
    from bentwing.recording.payload import Transform


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


def described_mount(payload: Payload) -> Mount:
    """Return the mount as the payload describes it; without a description the frames coincide."""
    encoder = payload.encoder
    if encoder is None:
        return FixedMount(_pose(payload.T_imu_lidar))
    return MotorMount(
        T_imu_motor=_pose(encoder.T_imu_motor),
        axis=np.array(encoder.axis),
        encoder_zero=0.0,
        T_motor_lidar=_pose(encoder.T_motor_lidar),
    )


def _pose(transform: Transform | None) -> Pose:
    if transform is None:
        return Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    return Pose(np.array(transform.translation), np.array(transform.quaternion))
