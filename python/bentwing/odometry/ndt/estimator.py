# SPDX-License-Identifier: MIT OR Apache-2.0
"""NDT odometry: every scan is registered to the keyframes (Tazir 2020, algorithm 1)."""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.breaks import SCAN, Break
from bentwing.base.errors import NotEnoughDataError
from bentwing.base.mount import MotorMount
from bentwing.odometry.buffer import HELD
from bentwing.odometry.core_states import core_globals
from bentwing.odometry.interface import Estimator, Snapshot
from bentwing.odometry.ndt.keyframes import Keyframes
from bentwing.odometry.ndt.levelling import Levelling
from bentwing.odometry.ndt.matching import Match, Matcher
from bentwing.odometry.ndt.motion import REST, Placed, Track
from bentwing.odometry.ndt.outcome import Found, estimate_of, record_of
from bentwing.odometry.ndt.phases import Following, Opening, Waiting
from bentwing.odometry.ndt.scans import Scan
from bentwing.odometry.ndt.settings import NdtSettings
from bentwing.odometry.ndt.snapshot import snapshot_of
from bentwing.odometry.planar import refuse_planar_kind, refuse_plane
from bentwing.recording.batches import ImuBatch
from bentwing.recording.described import described_calibration

if TYPE_CHECKING:
    from bentwing.base.estimate import Estimate
    from bentwing.base.window_record import WindowRecord
    from bentwing.odometry.ndt.phases import Begun, Phase
    from bentwing.recording import Batch, Payload

# Fewer points are no scan.
MIN_POINTS = 200
# Without a registered scan for longer than this the place is lost, s.
LOST_AFTER = 1.0


class Ndt(Estimator):
    """NDT odometry of a 3D lidar, fixed or turned by a motor; feed batches in time order.

    Lidar only: an IMU levels the map and does nothing else. Its frame and its clock are the
    trajectory's all the same; without one the lidar's or the motor's frame stands in for it.

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
        super().__init__()
        self.settings: NdtSettings = settings or NdtSettings()
        self._has_imu = payload.imu is not None
        self._calibration = described_calibration(payload)
        n_threads = threads or 0
        self._matcher = Matcher(
            core_globals(self._calibration), self.settings.max_points, n_threads
        )
        self._keyframes = Keyframes(self.settings, lidar.max_range, lidar.range_sigma, n_threads)
        self._levelling = Levelling()
        self._phase: Phase = Waiting()
        # Stamps of the first and the newest return, s, and how many scans long the time between is.
        self._first, self._last = np.inf, -np.inf
        self._n_stretches = 0
        # The stamp up to which scans have found their place, s.
        self._end = -np.inf
        self._tracks: list[Track] = []
        self._windows: list[WindowRecord] = []
        self._breaks: list[Break] = []
        self._n_small = 0
        self._seconds = 0.0

    def take(self, batch: Batch) -> None:
        """Hold the next batch for `advance`."""
        super().take(batch)
        if isinstance(batch, ImuBatch) and self._has_imu:
            self._levelling.add(batch)

    @property
    def step_length(self) -> float:
        """How much new lidar data a step takes at most, s."""
        return self.settings.scan

    def advance(self, *, finishing: bool = False) -> bool:
        """Register the scan of the next stretch of time, if that is complete; returns whether it is."""
        span = self.buffer.lidar_span
        if span is None:
            return False
        self._first, self._last = min(self._first, span[0]), max(self._last, span[1])
        start = self._first + self._n_stretches * self.settings.scan
        stop = start + self.settings.scan
        # A scan is complete when a later return has come.
        if span[1] < stop and not (finishing and start <= span[1]):
            return False
        self._n_stretches += 1
        self._register(start, stop)
        # What is held of the other sensor shows whether its times go back.
        self.buffer.forget(stop - HELD)
        return True

    @property
    def current(self) -> Snapshot | None:
        """What the track under way knows now; None until its map can be level."""
        found = self._found(self._end)
        if not self._windows or not found.can_be_level:
            return None
        return Snapshot(snapshot_of(found), len(self._tracks), partial(estimate_of, found))

    def so_far(self) -> Estimate:
        """Return what the scans registered so far say.

        Raises
        ------
        NotEnoughDataError
            There are fewer than two.
        """
        if not self._windows:
            msg = (
                f"fewer than two scans of {self.settings.scan:g} s with {MIN_POINTS} lidar points "
                "each; nothing can be estimated"
            )
            raise NotEnoughDataError(msg)
        return estimate_of(self._found(self._last))

    def _found(self, end: float) -> Found:
        """Return what is found up to a stamp, s; it does not change any more."""
        return Found(
            [track.copy() for track in self._tracks],
            (self._first, end),
            self._levelling.copy(),
            self._calibration,
            [*self._windows],
            [*self._breaks],
            counts={
                "ndt.scans": len(self._windows) + 1,
                "ndt.keyframes": self._keyframes.n_keyframes,
                "ndt.scans_not_registered": sum(not w.registered for w in self._windows),
                "ndt.scans_too_small": self._n_small,
            },
            timings={**self._matcher.timings, "keyframes": self._seconds},
        )

    def _register(self, start: float, stop: float) -> None:
        """Register the scan of one stretch of time, if there is one."""
        returns = self.buffer.lidar(start, stop)
        if len(returns.times) < MIN_POINTS:
            self._n_small += len(returns.times) > 0
            return
        if isinstance(self._calibration.mount, MotorMount) and returns.angles is None:
            msg = "angles: expected the motor's angle of every point, got None"
            raise ValueError(msg)
        scan, phase = Scan.of(returns, self._calibration.latency), self._phase
        if isinstance(phase, Waiting):
            refuse_plane(scan.points, "NDT odometry")
            origin = Placed(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), scan.time)
            self._begin(scan, origin, stop)
        else:
            self._follow(phase, scan, stop)

    def _begin(self, scan: Scan, pose: Placed, stop: float) -> None:
        """Begin a track with a keyframe and nothing before it."""
        track = Track(pose)
        self._tracks.append(track)
        self._phase, self._end = Opening(track, scan), stop
        self._keyframes.clear()
        points = self._matcher.placed(scan, REST)
        self._keyframes.add(points, pose, scan.lidar_at(pose, self._calibration.mount))

    def _follow(self, phase: Begun, scan: Scan, stop: float) -> None:
        """Register a scan, and make it a keyframe if the lidar has moved."""
        track, match = phase.track, self._match(phase, scan)
        self._windows.append(record_of(stop, len(self._keyframes.reference), match))
        if match is None:
            if scan.time - track.last.time > LOST_AFTER:
                # Begin anew where the last motion leads.
                self._breaks.append(Break(SCAN, track.last.time, scan.time))
                self._begin(scan, track.expected(scan.time), stop)
            return
        track.add(match.pose)
        self._phase, self._end = Following(track), stop
        lidar = scan.lidar_at(match.pose, self._calibration.mount)
        if self._keyframes.wants(lidar):
            began = time.perf_counter()
            self._keyframes.add(match.points, match.pose, lidar)
            self._seconds += time.perf_counter() - began

    def _match(self, phase: Begun, scan: Scan) -> Match | None:
        """Find the place of a scan; the second of a track also tells how the first one was bent."""
        track = phase.track
        match = self._matcher.match(scan, track, self._keyframes.reference)
        if match is None or isinstance(phase, Following):
            return match
        first, pose = phase.scan, track.last
        points = self._matcher.placed(first, track.twist_at(match.pose))
        self._keyframes.renew(points, pose, first.lidar_at(pose, self._calibration.mount))
        return self._matcher.match(scan, track, self._keyframes.reference)
