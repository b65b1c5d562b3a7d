# SPDX-License-Identifier: MIT OR Apache-2.0
"""A run of the filter as it is after a sweep: what others may read while the filter goes on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.covariances import PoseCovariances
from bentwing.base.trajectory import Trajectory
from bentwing.odometry.level_snapshot import LevelSnapshot
from bentwing.odometry.segments import turned
from bentwing.odometry.start import levelling

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.calibration import Calibration
    from bentwing.base.window_record import WindowRecord

    Poses = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]

# Sweeps whose poses are handed on at once: a second of them.
N_RECENT = 10


@dataclass(frozen=True)
class FilterSnapshot(LevelSnapshot):
    """What a run of the filter has found, level; everything is a copy or is never changed.

    Attributes
    ----------
    end : stamp up to which lidar data was used, s
    gravity : (3,) m/s², as the filter has it, by which the poses are levelled
    calibration : the slow states
    windows : records of the sweeps
    poses : of the sweeps, not levelled
    doubts : times, s, and covariances (6, 6) of the poses after some sweeps, not levelled
    blind, seconds : without inertial samples, and of work
    is_settling : whether it is a rehearsal
    """

    end: float
    gravity: NDArray[np.float64]
    calibration: Calibration
    windows: list[WindowRecord]
    poses: list[Poses]
    doubts: list[tuple[float, NDArray[np.float64]]]
    blind: float
    seconds: float
    is_settling: bool

    def trajectory(self) -> Trajectory:
        """Return all poses, 100 a second."""
        return self._levelled(self.poses)

    def recent(self) -> Trajectory:
        """Return the poses of the last second."""
        return self._levelled(self.poses[-N_RECENT:])

    def covariances(self, trajectory: Trajectory) -> PoseCovariances:
        """Return those of some poses of what `trajectory` has returned."""
        known = [(t, c) for t, c in self.doubts if trajectory.covers(np.array([t]))[0]]
        times = np.array([t for t, _ in known])
        matrices = np.array([c for _, c in known]).reshape(-1, 6, 6)
        away = trajectory.interpolate(times)[0]
        gravity = np.array(self.calibration.std.get("gravity", [0.0, 0.0]))
        return PoseCovariances(times, matrices).levelled(away, gravity)

    def _levelled(self, parts: list[Poses]) -> Trajectory:
        return turned(joined_poses(parts), levelling(self.gravity))


def joined_poses(parts: list[Poses]) -> Trajectory:
    """Return the poses of consecutive sweeps as one trajectory."""
    if not parts:
        return Trajectory(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 4)))
    times, positions, quats = zip(*parts, strict=True)
    return Trajectory(np.concatenate(times), np.concatenate(positions), np.concatenate(quats))
