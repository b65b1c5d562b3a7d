# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is true of a simulated inertial unit, in the frame and the terms of an estimate."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.base.inertial_unit import InertialUnit
from bentwing.base.mount import FixedMount, Pose

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bentwing.base.calibration import Calibration
    from bentwing.base.mount import Mount

    Array = NDArray[np.float64]


def in_frame_of(
    found: Calibration, true: Calibration, response: Mapping[str, Any] | None
) -> Calibration:
    """Return the truth in the frame of the unit that an estimate has, with its reference force.

    Parameters
    ----------
    true : as the simulation defines it: biases are those without any force
    response : `gyro`, `accel` and `g_sensitivity` (3, 3) that were drawn; None: a perfect unit
    """
    gyro = accel = np.eye(3)
    sensitivity = np.zeros((3, 3))
    if response is not None:
        gyro, accel, sensitivity = (
            np.array(response[name]) for name in ("gyro", "accel", "g_sensitivity")
        )
    reference, axis, to_force = found.unit.reference, found.unit.main_axis, np.linalg.inv(accel)
    to_rate = np.asarray(np.linalg.inv(gyro), float)
    R = _frame_of(to_rate, axis)
    rate = R @ to_rate
    felt = rate @ sensitivity @ to_force
    resting = to_force @ (reference - true.accel_bias)
    return replace(
        true,
        mount=_turned(true.mount, R),
        gyro_bias=true.gyro_bias + sensitivity @ resting,
        accel_bias=reference - R @ resting,
        unit=InertialUnit(rate - np.eye(3), felt, R @ to_force - np.eye(3), reference, axis),
    )


def _turned(mount: Mount, R: Array) -> Mount:
    """Return a mount on an IMU whose frame is turned by R (3, 3)."""

    def turned(pose: Pose) -> Pose:
        quat = geometry.multiply(geometry.from_matrices(R[None])[0], pose.quaternion)
        return Pose(R @ pose.translation, quat)

    if isinstance(mount, FixedMount):
        return FixedMount(turned(mount.T_imu_lidar))
    return replace(mount, T_imu_motor=turned(mount.T_imu_motor))


def _frame_of(rate: Array, main_axis: int) -> Array:
    """Return R (3, 3) with which `R @ rate` has a pure main axis and is symmetric across it."""
    i, j, k = (main_axis + 1) % 3, (main_axis + 2) % 3, main_axis
    axis = rate[:, k] / np.linalg.norm(rate[:, k])
    to_axis = _shortest(axis, np.eye(3)[k])
    turned = to_axis @ rate
    angle = np.arctan2(turned[i, j] - turned[j, i], turned[i, i] + turned[j, j])
    about = np.eye(3)
    about[[i, j], [i, j]] = np.cos(angle)
    about[i, j], about[j, i] = -np.sin(angle), np.sin(angle)
    return np.asarray(about @ to_axis)


def _shortest(start: Array, stop: Array) -> Array:
    """Return the rotation (3, 3) that turns one unit vector to another the shortest way."""
    x, y, z = np.cross(start, stop)
    hat = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + hat + hat @ hat / (1.0 + start @ stop))


def unit_errors(found: InertialUnit, true: InertialUnit) -> dict[str, Array]:
    """Return found minus true, by the names of the standard deviations."""
    gyro, accel = found.gyro - true.gyro, found.accel - true.accel
    return {
        "gyro_scale": np.diag(gyro),
        "gyro_misalignment": np.array([gyro[place] for place in found.misalignments]),
        "g_sensitivity": (found.g_sensitivity - true.g_sensitivity).ravel(),
        "accel_scale": np.diag(accel),
        "accel_misalignment": accel[~np.eye(3, dtype=bool)],
    }
