# SPDX-License-Identifier: MIT OR Apache-2.0
"""Kalman odometry: inertial samples predict, sweeps of the lidar correct (Fu 2023, figure 3)."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from bentwing.base.errors import NotEnoughDataError, PayloadError, RecordingError
from bentwing.base.mount import FixedMount, MotorMount, Mount
from bentwing.base.trajectory import DT
from bentwing.odometry.buffer import HELD
from bentwing.odometry.interface import Estimator, Snapshot
from bentwing.odometry.kalman.beginning import described_beginning
from bentwing.odometry.kalman.core import FilterSettings
from bentwing.odometry.kalman.filter_pass import MIN_POINTS, FilterPass
from bentwing.odometry.kalman.outcome import estimate_of
from bentwing.odometry.kalman.phases import Rehearsing, Running, Waiting
from bentwing.odometry.kalman.settings import KalmanSettings
from bentwing.odometry.planar import refuse_planar_kind, refuse_plane
from bentwing.odometry.segments import MAX_IMU_GAP
from bentwing.odometry.start import find_start
from bentwing.recording.described import described_calibration

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bentwing.base.breaks import Break
    from bentwing.base.estimate import Estimate
    from bentwing.base.mount import Pose
    from bentwing.base.trajectory import Trajectory
    from bentwing.odometry.buffer import LidarStretch
    from bentwing.odometry.kalman.beginning import Beginning
    from bentwing.odometry.kalman.phases import Begun, Phase
    from bentwing.recording import Payload

# The start is judged by the inertial samples of this time, s.
LOOK_AHEAD = 1.5
# A sweep is complete when there are inertial samples beyond its end by this, s.
BEYOND = 0.02
# Lidar data without inertial data for so long: there is no IMU, s.
NO_IMU = 3.0
NEEDS_IMU = (
    "the Kalman filter predicts by an IMU and there is none {where}; use --estimator continuous or "
    "--estimator ndt, which need none"
)


class Kalman(Estimator):
    """Error-state iterated Kalman filter; feed batches in time order, then ask for the result.

    Mounts and delays are part of the state, but the first views of the map are made while they are
    hardly known. So the filter begins twice: after some seconds again from the start, with what it
    has learned of them.

    Raises
    ------
    PayloadError
        If the payload describes a 2D lidar, or no IMU.
    """

    def __init__(
        self,
        payload: Payload,
        settings: KalmanSettings | None = None,
        threads: int | None = None,
    ) -> None:
        del threads  # the filter runs on one
        refuse_planar_kind(payload, "the Kalman filter")
        if payload.imu is None:
            raise PayloadError(NEEDS_IMU.format(where="in the payload (imu: null)"))
        super().__init__()
        self.settings: KalmanSettings = settings or KalmanSettings()
        self._payload = payload
        self._imu = payload.imu
        self._described = described_calibration(payload)
        self._phase: Phase = Waiting(rehearses=self.settings.rehearsal > 0)
        # What came before the last break.
        self._before: list[FilterPass] = []
        self._breaks: list[Break] = []
        self._n_begun = 0
        self._n_small = 0

    @property
    def step_length(self) -> float:
        """How much new lidar data a step takes at most, s."""
        return self.settings.scan

    def advance(self, *, finishing: bool = False) -> bool:
        """Begin, take a sweep, begin again, or pass a break; returns whether one was possible."""
        self._require_imu(finishing=finishing)
        lidar, imu = self.buffer.lidar_span, self.buffer.imu_span
        if lidar is None or imu is None:
            return False
        phase, broken, latency = self._phase, self.buffer.first_break(), self._described.latency
        if isinstance(phase, Waiting):
            return self._begin(phase, lidar[0] - latency, imu, finishing=finishing)
        ready = min(lidar[1] - latency, imu[1] + MAX_IMU_GAP if finishing else imu[1] - BEYOND)
        if broken is not None and broken.start <= ready:
            ready, finishing = broken.start, True
        else:
            broken = None
        if self._step(phase, ready, finishing=finishing):
            return True
        if isinstance(phase, Rehearsing) and finishing and phase.under_way.windows:
            return self._begin_again(phase)
        return broken is not None and self._pass_break(phase, broken)

    @property
    def current(self) -> Snapshot | None:
        """What the pass under way knows now; None until it has taken a sweep."""
        phase = self._phase
        if isinstance(phase, Waiting) or not phase.under_way.windows:
            return None
        now = phase.under_way.snapshot(is_settling=isinstance(phase, Rehearsing))
        passes = [*(p.snapshot() for p in self._before), now]
        estimate = partial(estimate_of, passes, [*self._breaks], self._n_small)
        return Snapshot(now, self._n_begun, estimate)

    def so_far(self) -> Estimate:
        """Return what the sweeps so far say.

        Raises
        ------
        NotEnoughDataError
            There are fewer than two.
        """
        passes = self._passes
        n = sum(len(p.windows) for p in passes)
        if n < 2:
            msg = (
                f"{n} sweeps of {self.settings.scan:g} s with lidar points and inertial samples; "
                "two are needed at least"
            )
            raise NotEnoughDataError(msg)
        return estimate_of([p.snapshot() for p in passes], self._breaks, self._n_small)

    def odometry(self) -> tuple[Trajectory, Trajectory]:
        """Return the high-rate odometry, raw and smoothed, in the frame of the first pose.

        Each pose is as it was known at its time: carried by the inertial samples from the last
        update on. The smoothed one went through the low-pass of `smoothing`.

        Raises
        ------
        NotEnoughDataError
            There is none yet.
        """
        if not self._passes:
            msg = "no pose yet: less than 1.5 s of inertial samples"
            raise NotEnoughDataError(msg)
        return self._passes[-1].odometry()

    def pose_covariances(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return times (K,) and covariances (K, 6, 6) of the pose after each sweep, rotation first."""
        return self._passes[-1].pose_covariances()

    def anchor(self) -> tuple[float, Pose]:
        """Return when the map begins, s, and where the motor (or the fixed lidar) is then, map frame.

        This pose is exact, whatever its truth: `pose_covariances` are relative to it.
        """
        last = self._passes[-1]
        return last.start, last.anchor()

    @property
    def _passes(self) -> list[FilterPass]:
        if isinstance(self._phase, Waiting):
            return self._before
        return [*self._before, self._phase.under_way]

    def _require_imu(self, *, finishing: bool) -> None:
        span = self.buffer.lidar_span
        if span is None or self._passes or self.buffer.has_imu:
            return
        if finishing or span[1] - span[0] > NO_IMU:
            where = f"in the first {span[1] - span[0]:.1f} s of the recording"
            raise RecordingError(NEEDS_IMU.format(where=where))

    def _begin(
        self, phase: Waiting, lidar: float, imu: tuple[float, float], *, finishing: bool
    ) -> bool:
        if imu[1] - imu[0] < LOOK_AHEAD and not finishing:
            return False
        seen = self.buffer.imu(imu[0], imu[0] + LOOK_AHEAD)
        if len(seen.times) < 2:
            return False
        first = max(lidar, imu[0] + 2 * DT)
        start, mount = find_start(seen, self._imu, first), self._taken_mount(first)
        beginning = described_beginning(first, start, self._payload, mount)
        if self._before:
            beginning = self._before[-1].continued(beginning)
        begun = self._new_pass(beginning, renew=phase.rehearses)
        self._phase = Rehearsing(begun) if phase.rehearses else Running(begun)
        return True

    def _taken_mount(self, first: float) -> Mount:
        """Return the mount as the filter takes it: without a zero, and fixed if its turning is ignored."""
        mount = self._described.mount
        if isinstance(mount, FixedMount):
            return mount
        if self.settings.rotation == "encoder":
            return mount.with_zero_behind_motor()
        stamp = first + self._described.latency
        angles = self.buffer.lidar(stamp, stamp + 1.0).angles
        angle = 0.0 if angles is None or not len(angles) else float(angles[0])
        return FixedMount(mount.lidar_at(angle))

    def _new_pass(self, beginning: Beginning, *, renew: bool) -> FilterPass:
        """Return a pass; `renew`: its voxels forget what is old."""
        settings = FilterSettings.of(
            self.settings, self._payload.lidar, self._imu, beginning.described.mount, renew=renew
        )
        self._n_begun += 1
        return FilterPass(settings, beginning)

    def _begin_again(self, phase: Rehearsing) -> bool:
        """Leave the rehearsal: from the start again, with what was learned."""
        self._phase = Running(self._new_pass(phase.under_way.again(), renew=False))
        self._n_small = 0
        return True

    def _pass_break(self, phase: Begun, broken: Break) -> bool:
        """Forget what is before a silence; what follows begins anew."""
        self._breaks.append(broken)
        self._before.append(phase.under_way)
        self.buffer.cut(broken.stop)
        self._phase = Waiting(rehearses=isinstance(phase, Rehearsing))
        return True

    def _step(self, phase: Begun, ready: float, *, finishing: bool) -> bool:
        """Take the next sweep if it is complete; returns whether it was."""
        now, scan = phase.under_way, self.settings.scan
        stop = now.start + scan * (round((now.end - now.start) / scan) + 1)
        if isinstance(phase, Rehearsing) and stop - now.start > self.settings.rehearsal:
            return self._begin_again(phase)
        if ready < stop:
            if not finishing or ready - now.end < DT:
                return False
            stop = ready
        sweep = self._sweep(now, stop)
        if not now.windows and not self._before and len(sweep.times):
            refuse_plane(sweep.points, "the Kalman filter")
        self._n_small += 0 < len(sweep.times) < MIN_POINTS
        imu = self.buffer.imu(now.end - 2 * BEYOND, stop + BEYOND)
        now.take(imu, sweep, stop)
        if isinstance(phase, Running):
            self.buffer.forget(stop - HELD)
        return True

    def _sweep(self, now: FilterPass, stop: float) -> LidarStretch:
        sweep = self.buffer.lidar(now.end + now.latency, stop + now.latency)
        if not isinstance(now.mount, MotorMount):
            return replace(sweep, angles=None)
        if sweep.angles is None and len(sweep.times):
            msg = "angles: expected the motor's angle of every point, got None"
            raise ValueError(msg)
        if sweep.angles is None:
            return sweep
        return replace(sweep, angles=sweep.angles + now.mount.errors.added(sweep.angles))
