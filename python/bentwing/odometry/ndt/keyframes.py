# SPDX-License-Identifier: MIT OR Apache-2.0
"""The keyframes: which scans become one, and the reference that they are for the others."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.base import geometry
from bentwing.odometry.core_states import core_pose

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.mount import Pose
    from bentwing.odometry.ndt.settings import NdtSettings

# Least standard deviation of a surface in voxels: ground and walls are no planes.
ROUGHNESS = 0.03
# What is farther away than the lidar sees, and by this share of its range, is forgotten when the
# lidar has moved by the share.
SPARE = 0.25


class Keyframes:
    """Surfaces seen by the keyframes, and where the last one was taken.

    Parameters
    ----------
    settings : when a scan becomes a keyframe, and the voxels
    max_range, sigma : m, of the lidar
    threads : 0 is one per core
    """

    def __init__(self, settings: NdtSettings, max_range: float, sigma: float, threads: int) -> None:
        self._settings = settings
        self._max_range = max_range
        self._sigma = sigma
        self._threads = threads
        self.reference = self._nothing()
        self.n_keyframes = 0
        self._last: Pose | None = None
        self._swept: Pose | None = None

    def clear(self) -> None:
        """Forget all of them."""
        self.reference = self._nothing()
        self._last = self._swept = None

    def renew(self, points: NDArray[np.float64], pose: Pose, lidar: Pose) -> None:
        """Replace the only keyframe there is by a better one; as `add`."""
        self.clear()
        self.n_keyframes -= 1
        self.add(points, pose, lidar)

    def wants(self, lidar: Pose) -> bool:
        """Whether the lidar has moved or turned enough since the last keyframe.

        The turn counts as well as the distance, for the lidar of a hovering carrier sees something
        else whenever the motor has turned it.
        """
        if self._last is None:
            return True
        moved = np.linalg.norm(lidar.translation - self._last.translation)
        turn = geometry.multiply(geometry.inverse(self._last.quaternion), lidar.quaternion)
        turned = np.linalg.norm(geometry.log(turn))
        limits = self._settings
        return bool(moved >= limits.keyframe_distance or turned >= limits.keyframe_angle)

    def add(self, points: NDArray[np.float64], pose: Pose, lidar: Pose) -> None:
        """Make a scan a keyframe.

        Parameters
        ----------
        points : (N, 3) float64, m, imu frame at the pose's time
        pose, lidar : of the IMU and of the lidar in the map
        """
        if self._settings.reference == "last":
            self.reference = self._nothing()
        self.reference.insert(
            points, core_pose(pose), lidar=lidar.translation.tolist(), threads=self._threads
        )
        self.n_keyframes += 1
        self._last = lidar
        self._sweep(lidar)

    def _nothing(self) -> _core.NdtReference:
        return _core.NdtReference(
            voxel_size=self._settings.voxel_size,
            n_levels=self._settings.n_levels,
            sigma=self._sigma,
            roughness=ROUGHNESS,
        )

    def _sweep(self, lidar: Pose) -> None:
        if self._swept is None:
            self._swept = lidar
        spare = SPARE * self._max_range
        if np.linalg.norm(lidar.translation - self._swept.translation) > spare:
            self._swept = lidar
            reach = self._max_range + spare
            self.reference.keep_within(lidar.translation.tolist(), reach, threads=self._threads)
