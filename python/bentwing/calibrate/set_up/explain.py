# SPDX-License-Identifier: MIT OR Apache-2.0
"""The simplest description of a head that explains how its IMU follows the lidar."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.calibrate.set_up import axes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

AGREE = np.radians(12.0)
"""Between a rotation that is described and one that is found: what an estimator corrects by itself."""
# What each deviation from the description costs: the fewer, the likelier.
MOUNT, AXES, MIRRORED = 1.0, 1.1, 1.2
_IDENTITY = np.eye(3)
_MIRROR = np.diag([1.0, -1.0, 1.0])


@dataclass(frozen=True, slots=True)
class Explanation:
    """How the samples of lidar and IMU are to be read, and how the lidar is mounted.

    Attributes
    ----------
    R_imu_lidar : (3, 3)
    gyro_axes, accel_axes : (3, 3) signed axes that take the samples to the imu frame
    mirrored : whether the scans run the other way
    cost : how far it is from the description
    """

    R_imu_lidar: NDArray[np.float64]
    gyro_axes: NDArray[np.float64]
    accel_axes: NDArray[np.float64]
    mirrored: bool
    cost: float


def explain(
    gyro: NDArray[np.float64],
    accel: NDArray[np.float64],
    described: NDArray[np.float64] | None,
) -> Explanation | None:
    """Return the cheapest explanation; None if there is none.

    Parameters
    ----------
    gyro, accel : (3, 3) orthogonal, from the lidar's frame to the axes of each sensor; of
        determinant -1 where they are mirrored
    described : (3, 3) R_imu_lidar as the payload has it, if it has
    """
    found = [
        explanation
        for mirrored in (False, True)
        for explanation in _explanations(gyro, accel, described, mirrored=mirrored)
    ]
    return min(found, key=lambda e: e.cost, default=None)


def _explanations(
    gyro: NDArray[np.float64],
    accel: NDArray[np.float64],
    described: NDArray[np.float64] | None,
    *,
    mirrored: bool,
) -> Iterator[Explanation]:
    if mirrored:
        # A rate is an axial vector, which a mirror turns the other way.
        gyro, accel = -gyro @ _MIRROR, accel @ _MIRROR
    proper = [M for M in (gyro, accel) if np.linalg.det(M) > 0.0]
    for R in [*([] if described is None else [described]), *proper]:
        gyro_axes, accel_axes = axes.nearest(R @ gyro.T), axes.nearest(R @ accel.T)
        off = [axes.angle_between(gyro_axes @ gyro, R), axes.angle_between(accel_axes @ accel, R)]
        if max(off) > AGREE:
            continue
        is_described = described is None or axes.angle_between(R, described) <= AGREE
        cost = 0.0 if is_described else MOUNT
        changed = {tuple(m.ravel()) for m in (gyro_axes, accel_axes)} - {tuple(_IDENTITY.ravel())}
        cost += AXES * len(changed) + MIRRORED * mirrored
        yield Explanation(gyro_axes @ gyro, gyro_axes, accel_axes, mirrored, cost)
