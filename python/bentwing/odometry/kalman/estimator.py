# SPDX-License-Identifier: MIT OR Apache-2.0
"""Kalman odometry: inertial samples predict, sweeps of the lidar correct (Fu 2023, figure 3)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.errors import NotEnoughDataError, PayloadError, RecordingError
from bentwing.base.mount import FixedMount, MotorMount, Mount, Pose
from bentwing.base.trajectory import DT
from bentwing.odometry.buffer import BatchBuffer
from bentwing.odometry.continuous.planar import refuse_planar_kind, refuse_plane
from bentwing.odometry.kalman.core import (
    FilterSettings,
    FilterState,
    anchored,
    first_covariance,
    first_state,
    unlearned_delay,
)
from bentwing.odometry.kalman.filter_pass import MIN_POINTS, FilterPass, Rest
from bentwing.odometry.kalman.outcome import estimate_of
from bentwing.odometry.kalman.settings import KalmanSettings
from bentwing.odometry.segments import MAX_IMU_GAP, extrapolated, heading
from bentwing.odometry.start import find_start, levelling
from bentwing.recording.described import described_mount

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.breaks import Break
    from bentwing.base.estimate import Estimate
    from bentwing.base.trajectory import Trajectory
    from bentwing.odometry.buffer import LidarStretch
    from bentwing.odometry.kalman.snapshot import FilterSnapshot
    from bentwing.recording import Batch, Payload

# The start is judged by the inertial samples of this time, s.
LOOK_AHEAD = 1.5
# A sweep is complete when there are inertial samples beyond its end by this, s.
BEYOND = 0.02
# Lidar data without inertial data for so long: there is no IMU, s.
NO_IMU = 3.0
# How much less certain a second beginning is of what the first has learned from the same data.
DOUBT = 2.0
# Batches that end within this time before the last sweep are held, s.
HELD = 1.0
NEEDS_IMU = (
    "the Kalman filter predicts by an IMU and there is none {where}; use --estimator continuous or "
    "--estimator ndt, which need none"
)


class Kalman:
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
        self.settings = settings or KalmanSettings()
        self._payload = payload
        self._imu = payload.imu
        self._mount = described_mount(payload)
        self._buffer = BatchBuffer()
        self._first: float | None = None
        self._rest: Rest | None = None
        self._passes: list[FilterPass] = []
        # What came before the last break.
        self._before: list[FilterSnapshot] = []
        self._begun: tuple[FilterState, NDArray[np.float64]] | None = None
        self._rehearsing = self.settings.rehearsal > 0
        self._n_small = 0
        self._lidar_end = 0.0
        self._angle: float | None = None
        self._breaks: list[Break] = []

    def feed(self, batch: Batch) -> None:
        """Take the next batch; sweeps that have become complete are worked in."""
        self.take(batch)
        self._advance(finishing=False)

    def take(self, batch: Batch) -> None:
        """Hold the next batch for `step`."""
        self._buffer.add(batch)

    def step(self, *, finishing: bool = False) -> FilterSnapshot | None:
        """Work in one sweep that has become complete; returns what is known then, None without any.

        The result is that of `feed`; `finishing` as `result` does.
        """
        self._require_imu(finishing=finishing)
        while self._go_on(finishing=finishing):
            if (current := self.current) is not None and current.windows:
                return self._snapshot(current)
        return None

    def result(self) -> Estimate:
        """Finish with what was fed so far.

        Raises
        ------
        NotEnoughDataError
            There are no two sweeps.
        RecordingError
            There are no inertial samples.
        DivergedError
            The points do not fit the inertial samples at all.
        """
        self._advance(finishing=True)
        return self.so_far()

    def so_far(self) -> Estimate:
        """Return what the sweeps so far say.

        Raises
        ------
        NotEnoughDataError
            There are fewer than two.
        """
        n = sum(len(p.windows) for p in self._passes)
        if n < 2:
            msg = (
                f"{n} sweeps of {self.settings.scan:g} s with lidar points and inertial samples; "
                "two are needed at least"
            )
            raise NotEnoughDataError(msg)
        if (current := self.current) is None:
            return estimate_of(self._before, self._breaks, self._n_small)
        return self.estimate(self._snapshot(current))

    def estimate(self, last: FilterSnapshot) -> Estimate:
        """Return what the passes before the last break and this one say, levelled."""
        return estimate_of([*self._before, last], self._breaks, self._n_small)

    @property
    def current(self) -> FilterPass | None:
        """The pass that is under way."""
        return self._passes[-1] if self._passes and self._first is not None else None

    @property
    def buffer(self) -> BatchBuffer:
        """What coming sweeps may need of the batches."""
        return self._buffer

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
        at, quat = last.anchor
        turn = levelling(np.array(last.filter.gravity))
        return last.start, Pose(geometry.rotate(turn, at), geometry.multiply(turn, quat))

    @property
    def _filter_mount(self) -> Mount:
        """The mount as the filter takes it: without a zero, and fixed where its turning is ignored."""
        mount = self._mount
        if isinstance(mount, FixedMount):
            return mount
        if self.settings.rotation == "encoder":
            return mount.with_zero_behind_motor()
        return FixedMount(mount.lidar_at(self._angle or 0.0))

    def _snapshot(self, of: FilterPass) -> FilterSnapshot:
        return of.snapshot(self._filter_mount, is_settling=self._rehearsing)

    def _advance(self, *, finishing: bool) -> None:
        self._require_imu(finishing=finishing)
        while self._go_on(finishing=finishing):
            pass

    def _require_imu(self, *, finishing: bool) -> None:
        span = self._buffer.lidar_span
        if span is None or self._passes or self._buffer.has_imu:
            return
        if finishing or span[1] - span[0] > NO_IMU:
            where = f"in the first {span[1] - span[0]:.1f} s of the recording"
            raise RecordingError(NEEDS_IMU.format(where=where))

    def _go_on(self, *, finishing: bool) -> bool:
        """Do what can be done next: begin, take a sweep, begin again; returns whether so."""
        lidar, imu = self._buffer.lidar_span, self._buffer.imu_span
        if lidar is None or imu is None:
            return False
        self._lidar_end = lidar[1]
        if self._first is None:
            return self._begin(lidar[0], imu, finishing=finishing)
        broken = self._buffer.first_break()
        ready = min(lidar[1], imu[1] + MAX_IMU_GAP if finishing else imu[1] - BEYOND)
        if broken is not None and broken.start <= ready:
            ready, finishing = broken.start, True
        if self._step(ready, finishing=finishing):
            return True
        if self._rehearsing and finishing and self._passes[-1].windows:
            return self._begin_again()
        if broken is not None and broken.start <= ready:
            return self._pass_break(broken)
        return False

    def _begin(self, lidar: float, imu: tuple[float, float], *, finishing: bool) -> bool:
        if imu[1] - imu[0] < LOOK_AHEAD and not finishing:
            return False
        first = max(lidar, imu[0] + 2 * DT)
        seen = self._buffer.imu(imu[0], imu[0] + LOOK_AHEAD)
        if len(seen.times) < 2:
            return False
        if isinstance(self._mount, MotorMount):
            self._angle = self._first_angle(first)
        start = find_start(seen, self._imu)
        static = start.static
        self._rest = None if static is None else Rest(static.gyro_bias, static.accel_mean)
        mount = self._filter_mount
        state = first_state(start, mount, self._payload.lidar.latency)
        covariance = first_covariance(start, mount)
        if self._passes:
            state, covariance = self._continued(first, state, covariance)
        self._first, self._begun = first, (state, covariance)
        self._passes.append(self._new_pass(state, covariance))
        return True

    def _continued(
        self, first: float, state: FilterState, covariance: NDArray[np.float64]
    ) -> tuple[FilterState, NDArray[np.float64]]:
        """Return a start behind a break: what was learned, in the direction of the last motion."""
        before = self._passes[-1]
        at, quat = extrapolated(before.trajectory(), first)
        level = np.array(state.pose[1])
        turn = heading(geometry.multiply(quat, geometry.inverse(level)))
        placed = at.tolist(), geometry.multiply(turn, level).tolist()
        return replace(before.slow_state(state), pose=placed), before.slow_covariance(
            covariance, 1.0
        )

    def _first_angle(self, first: float) -> float:
        angles = self._buffer.lidar(first, first + 1.0).angles
        return 0.0 if angles is None or not len(angles) else float(angles[0])

    def _new_pass(self, state: FilterState, covariance: NDArray[np.float64]) -> FilterPass:
        settings = FilterSettings.of(
            self.settings,
            self._payload.lidar,
            self._imu,
            self._filter_mount,
            renew=self._rehearsing,
        )
        assert self._first is not None
        return FilterPass(settings, self._first, state, anchored(covariance, state), self._rest)

    def _begin_again(self) -> bool:
        """Leave the rehearsal: from the start again, with what was learned."""
        rehearsed, self._rehearsing = self._passes.pop(), False
        assert self._begun is not None
        state = rehearsed.slow_state(self._begun[0])
        covariance = rehearsed.slow_covariance(self._begun[1], DOUBT)
        if isinstance(mount := self._filter_mount, MotorMount):
            covariance += unlearned_delay(rehearsed.motor_rate, mount, state)
        self._passes.append(self._new_pass(state, covariance))
        self._n_small = 0
        return True

    def _pass_break(self, broken: Break) -> bool:
        """Forget what is before a silence; what follows begins anew."""
        self._breaks.append(broken)
        self._before.append(self._snapshot(self._passes[-1]))
        self._buffer.cut(broken.stop)
        self._first = None
        return True

    def _step(self, ready: float, *, finishing: bool) -> bool:
        """Take the next sweep if it is complete; returns whether it was."""
        assert self._first is not None
        current, scan = self._passes[-1], self.settings.scan
        stop = self._first + scan * (round((current.end - self._first) / scan) + 1)
        if self._rehearsing and stop - self._first > self.settings.rehearsal:
            return self._begin_again()
        if ready < stop:
            if not finishing or ready - current.end < DT:
                return False
            stop = ready
        sweep = self._sweep(current.end, stop)
        if not current.windows and not len(self._passes) > 1 and len(sweep.times):
            refuse_plane(sweep.points, "the Kalman filter")
        self._n_small += 0 < len(sweep.times) < MIN_POINTS
        imu = self._buffer.imu(current.end - 2 * BEYOND, stop + BEYOND)
        current.take(imu, sweep, stop)
        if not self._rehearsing:
            self._buffer.forget(stop - HELD)
        return True

    def _sweep(self, start: float, stop: float) -> LidarStretch:
        sweep = self._buffer.lidar(start, stop)
        if not isinstance(self._filter_mount, MotorMount):
            return replace(sweep, angles=None)
        if sweep.angles is None and len(sweep.times):
            msg = "angles: expected the motor's angle of every point, got None"
            raise ValueError(msg)
        return sweep
