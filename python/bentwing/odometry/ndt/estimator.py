# SPDX-License-Identifier: MIT OR Apache-2.0
"""NDT odometry: every scan is registered to the keyframes (Tazir 2020, algorithm 1)."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.breaks import SCAN, Break
from bentwing.base.errors import NotEnoughDataError
from bentwing.base.estimate import Estimate
from bentwing.base.mount import FixedMount, MotorMount, Pose
from bentwing.odometry.buffer import BatchBuffer
from bentwing.odometry.continuous.planar import refuse_planar_kind, refuse_plane
from bentwing.odometry.core_states import core_globals
from bentwing.odometry.ndt.keyframes import Keyframes
from bentwing.odometry.ndt.levelling import Levelling
from bentwing.odometry.ndt.matching import Match, Matcher
from bentwing.odometry.ndt.motion import REST, Placed, Track
from bentwing.odometry.ndt.outcome import (
    calibration_of,
    health_of,
    levelled_trajectory,
    record_of,
)
from bentwing.odometry.ndt.scans import Scan
from bentwing.odometry.ndt.settings import NdtSettings
from bentwing.recording.batches import ImuBatch
from bentwing.recording.described import described_mount

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.window_record import WindowRecord
    from bentwing.recording import Batch, Payload

# Fewer points are no scan.
MIN_POINTS = 200
# Without a registered scan for longer than this the place is lost, s.
LOST_AFTER = 1.0
# Batches that end within this time before the last scan are held, s.
HELD = 1.0


class Ndt:
    """NDT odometry of a 3D lidar, fixed or turned by a motor; feed batches in time order.

    Lidar only: an IMU levels the map and does nothing else. Its frame is the trajectory's all the
    same; without one the lidar's or the motor's stands in for it.

    Raises
    ------
    PayloadError
        If the payload describes a 2D lidar.
    """

    def __init__(
        self, payload: Payload, settings: NdtSettings | None = None, threads: int | None = None
    ) -> None:
        lidar = payload.lidar
        refuse_planar_kind(payload, "NDT odometry")
        self.settings = settings or NdtSettings()
        self._has_imu = payload.imu is not None
        self._mount = described_mount(payload)
        self._calibration = calibration_of(self._mount)
        n_threads = threads or 0
        self._matcher = Matcher(
            core_globals(self._calibration), self.settings.max_points, n_threads
        )
        self._keyframes = Keyframes(self.settings, lidar.max_range, lidar.range_sigma, n_threads)
        self._buffer = BatchBuffer()
        self._levelling = Levelling()
        self._first: float | None = None
        self._last = 0.0
        self._n_stretches = 0
        self._tracks: list[Track] = []
        # The first scan of the newest track.
        self._opening: Scan | None = None
        self._windows: list[WindowRecord] = []
        self._n_small = 0
        self._seconds = 0.0
        self._breaks: list[Break] = []

    def feed(self, batch: Batch) -> None:
        """Take the next batch; scans that have become complete are registered."""
        self._buffer.add(batch)
        if isinstance(batch, ImuBatch) and self._has_imu:
            self._levelling.add(batch)
        self._advance(finishing=False)

    def result(self) -> Estimate:
        """Finish with what was fed so far.

        Raises
        ------
        NotEnoughDataError
            There are fewer than two scans.
        """
        self._advance(finishing=True)
        return self.so_far()

    def so_far(self) -> Estimate:
        """Return what the scans registered so far say.

        Raises
        ------
        NotEnoughDataError
            There are fewer than two.
        """
        if self._first is None or not self._windows:
            msg = (
                f"fewer than two scans of {self.settings.scan:g} s with {MIN_POINTS} lidar points "
                "each; nothing can be estimated"
            )
            raise NotEnoughDataError(msg)
        trajectory, segments = levelled_trajectory(
            self._tracks, (self._first, self._last), self._levelling
        )
        counts = {
            "ndt.scans": len(self._windows) + 1,
            "ndt.keyframes": self._keyframes.n_keyframes,
            "ndt.scans_not_registered": sum(not w.registered for w in self._windows),
            "ndt.scans_too_small": self._n_small,
        }
        return Estimate(
            trajectory,
            self._calibration,
            windows=[*self._windows],
            counts=counts,
            timings={**self._matcher.timings, "keyframes": self._seconds},
            health=health_of(self._windows),
            breaks=[*self._breaks],
            segments=segments,
        )

    def _advance(self, *, finishing: bool) -> None:
        span = self._buffer.lidar_span
        if span is None:
            return
        if self._first is None:
            self._first = span[0]
        self._last = max(self._last, span[1])
        while True:
            start = self._first + self._n_stretches * self.settings.scan
            stop = start + self.settings.scan
            # A scan is complete when a later return has come.
            if span[1] < stop and not (finishing and start <= span[1]):
                return
            self._n_stretches += 1
            self._take(start, stop)
            # What is held of the other sensor shows whether its times go back.
            self._buffer.forget(stop - HELD)

    def _take(self, start: float, stop: float) -> None:
        """Register the scan of one stretch of time, if there is one."""
        returns = self._buffer.lidar(start, stop)
        if len(returns.times) < MIN_POINTS:
            self._n_small += len(returns.times) > 0
            return
        if isinstance(self._mount, MotorMount) and returns.angles is None:
            msg = "angles: expected the motor's angle of every point, got None"
            raise ValueError(msg)
        scan = Scan.of(returns)
        if not self._tracks:
            refuse_plane(scan.points, "NDT odometry")
            self._begin(scan, Placed(scan.time, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])))
        else:
            self._follow(scan, stop)

    def _begin(self, scan: Scan, pose: Placed) -> None:
        """Begin a track with a keyframe and nothing before it."""
        self._keyframes.clear()
        self._tracks.append(Track(pose))
        self._opening = scan
        points = self._matcher.placed(scan, REST)
        self._keyframes.add(points, pose, self._lidar(scan, pose))

    def _follow(self, scan: Scan, stop: float) -> None:
        """Register a scan, and make it a keyframe if the lidar has moved."""
        track = self._tracks[-1]
        match = self._match(scan, track)
        self._windows.append(record_of(stop, len(self._keyframes.reference), match))
        if match is None:
            if scan.time - track.last.time > LOST_AFTER:
                self._lose(scan, track)
            return
        track.add(match.pose)
        lidar = self._lidar(scan, match.pose)
        if self._keyframes.wants(lidar):
            began = time.perf_counter()
            self._keyframes.add(match.points, match.pose, lidar)
            self._seconds += time.perf_counter() - began

    def _match(self, scan: Scan, track: Track) -> Match | None:
        """Find the place of a scan; the second of a track also tells how the first one was bent."""
        match = self._matcher.match(scan, track, self._keyframes.reference)
        if match is None or len(track.poses) > 1 or self._opening is None:
            return match
        first, pose = self._opening, track.last
        points = self._matcher.placed(first, track.twist_at(match.pose))
        self._keyframes.renew(points, pose, self._lidar(first, pose))
        return self._matcher.match(scan, track, self._keyframes.reference)

    def _lose(self, scan: Scan, track: Track) -> None:
        """Begin anew where the last motion leads."""
        self._breaks.append(Break(SCAN, track.last.time, scan.time))
        self._begin(scan, track.expected(scan.time))

    def _lidar(self, scan: Scan, pose: Placed) -> Placed:
        """Pose of the lidar at the time of a scan, given that of the IMU."""
        mount = self._mount
        if isinstance(mount, FixedMount):
            return _behind(pose, mount.T_imu_lidar)
        angle = mount.encoder_zero + (0.0 if scan.angles is None else float(scan.angles.mean()))
        motor = _behind(pose, mount.T_imu_motor)
        turned = _behind(motor, Pose(np.zeros(3), geometry.exp(angle * mount.axis)))
        return _behind(turned, mount.T_motor_lidar)


def _behind(pose: Placed, mounted: Pose) -> Placed:
    """Pose of what is mounted on a frame."""
    translation: NDArray[np.float64] = geometry.compose(
        pose.translation, pose.quat_xyzw, mounted.translation
    )
    quat = geometry.multiply(pose.quat_xyzw, mounted.quaternion)
    return Placed(pose.time, translation, quat)
