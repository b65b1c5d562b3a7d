# SPDX-License-Identifier: MIT OR Apache-2.0
"""VGICP of small_gicp, which is a library of registration, with an odometry around it.

Scans are deskewed by the gyro's attitude and a constant velocity, and matched against one
incremental map of voxels.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import small_gicp

from benches.peers.attitude import as_trajectory
from benches.peers.columns import stamps_of, xyz_of
from bentwing.base import geometry
from bentwing.base.transform import apply

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benches.peers.engines import Engine
    from benches.peers.feed import Feed

DOWNSAMPLING = 0.25
"""m."""
NEIGHBOURS = 10


class Odometry:
    """Pose of the body at the end of the newest scan, map frame."""

    def __init__(self, voxel_size: float) -> None:
        self.map = small_gicp.GaussianVoxelMap(voxel_size)
        self.R, self.t, self.v = np.eye(3), np.zeros(3), np.zeros(3)
        self.end: float | None = None

    def register(
        self,
        points: np.ndarray,
        before_end: np.ndarray,
        turns: Callable[[float, np.ndarray], np.ndarray],
        end: float,
    ) -> np.ndarray:
        """Take the points (N, 3) of a scan, measured so many s before its end.

        `turns(of, at)` are the rotations (N, 3, 3) from the body at times to the body at one.
        """
        dt = 0.0 if self.end is None else end - self.end
        guess = np.eye(4)
        guess[:3, :3] = self.R @ turns(self.end if dt else end, np.array([end]))[0]
        guess[:3, 3] = self.t + self.v * dt
        drawn = np.einsum("nij,nj->ni", turns(end, end - before_end), points)
        drawn -= before_end[:, None] * (guess[:3, :3].T @ self.v)
        cloud, _ = small_gicp.preprocess_points(drawn, DOWNSAMPLING, NEIGHBOURS, 1)
        T = guess
        if dt:
            T = small_gicp.align(self.map, cloud, guess, num_threads=1).T_target_source
            self.v = (T[:3, 3] - self.t) / dt
        self.map.insert(cloud, T)
        self.R, self.t, self.end = T[:3, :3], T[:3, 3], end
        return T


def run(feed: Feed, engine: Engine) -> Iterator[tuple[int, np.ndarray]]:
    """Poses of the body, one per scan, at its end."""
    head = feed.head
    odometry = Odometry(float(engine.settings["voxel_size"]))
    mount, turns = np.array(head.T_body_lidar), _turns(feed)
    for start, end, scan in zip(head.starts_ns, head.ends_ns, feed.scans(), strict=True):
        points = apply(mount, xyz_of(scan))
        before_end = 1e-9 * (end - stamps_of(scan, start))
        yield start, odometry.register(points, before_end, turns, 1e-9 * (end - head.starts_ns[0]))


def _turns(feed: Feed) -> Callable[[float, np.ndarray], np.ndarray]:
    imu = feed.imu
    times = 1e-9 * (imu.stamps_ns - feed.head.starts_ns[0])
    body = geometry.multiply(imu.turned, geometry.inverse(imu.R_body_imu))
    attitudes = as_trajectory(times, body)

    def turns(of: float, at: np.ndarray) -> np.ndarray:
        _, here = attitudes.interpolate(np.clip([of], times[0], times[-1]))
        _, there = attitudes.interpolate(np.clip(at, times[0], times[-1]))
        return geometry.to_matrices(geometry.multiply(geometry.inverse(here), there))

    return turns
