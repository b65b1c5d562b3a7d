# SPDX-License-Identifier: MIT OR Apache-2.0
"""The newest track as it is after a scan: what others may read while the odometry goes on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bentwing.odometry.level_snapshot import LevelSnapshot

if TYPE_CHECKING:
    from bentwing.base.calibration import Calibration
    from bentwing.base.trajectory import Trajectory
    from bentwing.base.window_record import WindowRecord
    from bentwing.odometry.ndt.outcome import Found

# Scans whose poses are handed on at once: a second and a half of them, more than may fit nowhere.
N_RECENT = 15
# So many before them shape the way between them.
N_BEFORE = 2


@dataclass(frozen=True)
class TrackSnapshot(LevelSnapshot):
    """What the scans of a track have found; everything is a copy or is never changed.

    Attributes
    ----------
    end : stamp up to which scans have found their place, s
    windows : records of the scans
    is_settling : whether the vertical is still being learned
    calibration : as the payload describes it
    poses : the recent ones, level
    """

    end: float
    windows: list[WindowRecord]
    is_settling: bool
    calibration: Calibration
    poses: Trajectory

    def recent(self) -> Trajectory:
        """Return the recent poses, level, 100 a second."""
        return self.poses


def snapshot_of(found: Found) -> TrackSnapshot:
    """Return what readers need of what was found, at a cost that does not grow with time."""
    track, start = found.tracks[-1], found.starts[-1]
    if len(track.poses) > N_RECENT:
        start = track.poses[-N_RECENT].time
    recent = track.sliced(-N_RECENT - N_BEFORE).trajectory(start, found.ends[-1])
    return TrackSnapshot(
        found.stamps[1],
        found.windows,
        found.is_settling,
        found.calibration,
        found.frame().level(recent),
    )
