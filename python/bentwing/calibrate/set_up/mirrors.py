# SPDX-License-Identifier: MIT OR Apache-2.0
"""Set-ups of a 2D lidar that look the same: the one sees the mirror image of the other's world.

A plane is its own mirror image. So a world that is mirrored at a point looks the same to a scanner
that is turned by half a turn about the normal of its scans, and one that is mirrored at the plane to
the scanner as it is; the IMU feels a negated force in the one, and a negated turn in the other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.calibrate.set_up import axes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Axes = tuple[NDArray[np.float64], NDArray[np.float64]]

ALONG = 0.9  # cosine between the normal of the scans and an axis of the IMU that is about the same
SAME_TURN = 0.2  # rad between mounts that are about the same
_HALF_TURN = np.diag([-1.0, -1.0, 1.0])  # about the normal of the scans
_POINT = (
    "either the lidar is mounted with half a turn about the normal of its scan plane, or all axes of the "
    "accelerometer are negated; a 2D lidar sees both alike: turn T_imu_lidar, or write imu: "
    "{axes: [-x, -y, -z], gyro_axes: [x, y, z]}"
)
_PLANE = (
    "either all axes of the gyro are negated, or the axis of the IMU across the scan plane of the lidar "
    "is; a 2D lidar sees both alike: write imu: {gyro_axes: [-x, -y, -z]}, or that axis negated in imu: "
    "{axes: [x, y, z]}"
)


def both_meanings(
    gyro: NDArray[np.float64],
    accel: NDArray[np.float64],
    R: NDArray[np.float64],
    described: NDArray[np.float64],
) -> str | None:
    """Say what a set-up that fits may mean, if one with which all is mirrored is as likely.

    Parameters
    ----------
    gyro, accel : (3, 3) axes of both
    R, described : (3, 3) rotations of the lidar in the IMU, as it fits and as the payload has it
    """
    if axes.angle_between(described @ _HALF_TURN, R) < SAME_TURN:
        return _POINT
    return _of_axes(gyro, accel, R) if axes.angle_between(described, R) < SAME_TURN else None


def _of_axes(
    gyro: NDArray[np.float64], accel: NDArray[np.float64], R: NDArray[np.float64]
) -> str | None:
    plain = np.eye(3)
    if np.array_equal(accel, -plain) and np.array_equal(gyro, plain):
        return _POINT
    if np.array_equal(gyro, -plain) and np.array_equal(accel, plain):
        return _PLANE
    other = _mirrored(gyro, accel, R)
    if other is None or not _blames_one(*other):
        return None
    return (
        f"either {_told(gyro, accel)}, or {_told(*other)}; a 2D lidar sees both alike: write imu: "
        f"{_line(gyro, accel)}, or imu: {_line(*other)}"
    )


def _mirrored(
    gyro: NDArray[np.float64], accel: NDArray[np.float64], R: NDArray[np.float64]
) -> Axes | None:
    """Return the axes with which the world is mirrored at the scan plane, if that lies along axes."""
    normal = R[:, 2]
    across = int(np.argmax(np.abs(normal)))
    if abs(normal[across]) < ALONG:
        return None
    mirror = np.eye(3)
    mirror[across, across] = -1.0
    return -mirror @ gyro, mirror @ accel


def _blames_one(gyro: NDArray[np.float64], accel: NDArray[np.float64]) -> bool:
    return np.array_equal(gyro, np.eye(3)) or np.array_equal(accel, np.eye(3))


def _told(gyro: NDArray[np.float64], accel: NDArray[np.float64]) -> str:
    name, found = ("gyro", gyro) if np.array_equal(accel, np.eye(3)) else ("accelerometer", accel)
    return f"x y z of the {name} are {_listed(found)}"


def _line(gyro: NDArray[np.float64], accel: NDArray[np.float64]) -> str:
    return f"{{axes: {_listed(accel)}, gyro_axes: {_listed(gyro)}}}"


def _listed(found: NDArray[np.float64]) -> str:
    return f"[{', '.join(axes.named(found))}]"
