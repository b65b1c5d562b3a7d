# SPDX-License-Identifier: MIT OR Apache-2.0
"""The continuous-time estimator: a sliding window of surfel registration (Kaul 2015, section 2)."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from bentwing.base.breaks import HEAD, Break
from bentwing.base.errors import NotEnoughDataError
from bentwing.base.trajectory import DT
from bentwing.odometry.continuous.beginning import begin_pass, find_beginning
from bentwing.odometry.continuous.odometry_pass import MARGIN
from bentwing.odometry.continuous.outcome import estimate_of
from bentwing.odometry.continuous.phases import Bridging, Running, Stalled, Waiting
from bentwing.odometry.continuous.settings import ContinuousSettings
from bentwing.odometry.continuous.standstill import SpinWatch
from bentwing.odometry.interface import Estimator, Snapshot
from bentwing.odometry.planar import is_plane
from bentwing.odometry.segments import JUDGED, MAX_IMU_GAP, found_again
from bentwing.odometry.stall import LOST_AFTER
from bentwing.recording import ImuBatch, LidarBatch
from bentwing.recording.described import described_calibration

if TYPE_CHECKING:
    from bentwing.base.estimate import Estimate
    from bentwing.odometry.buffer import BatchBuffer
    from bentwing.odometry.continuous.odometry_pass import OdometryPass
    from bentwing.odometry.continuous.phases import Begun, Phase
    from bentwing.recording import Batch, Payload

# At the beginning and behind a break the motion is a guess that must not grow until the lidar corrects
# it: so many windows instead of one.
CAREFUL_STEPS = 3


class Continuous(Estimator):
    """Continuous-time surfel odometry; feed batches in time order, then ask for the result.

    Latency, extrinsics and accelerometer bias cannot be known before the payload has turned. What was
    estimated until then follows them when they become known, see `OdometryPass`.
    """

    def __init__(
        self,
        payload: Payload,
        settings: ContinuousSettings | None = None,
        threads: int | None = None,
    ) -> None:
        super().__init__()
        self.settings: ContinuousSettings = settings or ContinuousSettings()
        self._payload = payload
        self._described = described_calibration(payload)
        self._threads = threads or 0
        self._phase: Phase = Waiting()
        # What came before the last break.
        self._before: list[OdometryPass] = []
        self._breaks: list[Break] = []
        # Whether the lidar is a 2D one, which sees single planes when its head stands still.
        self._is_planar = True
        self._has_imu = False
        self._spin = SpinWatch(by_encoder=payload.encoder is not None)

    def take(self, batch: Batch) -> None:
        """Hold the next batch for `advance`."""
        super().take(batch)
        if not len(batch.times):
            return
        if self._is_planar and isinstance(batch, LidarBatch) and len(batch.times) >= 3:
            self._is_planar = is_plane(batch.points)
        self._has_imu |= isinstance(batch, ImuBatch)
        self._spin.add(batch)

    @property
    def step_length(self) -> float:
        """How much new lidar data a step takes at most, s."""
        return self.settings.shift

    def advance(self, *, finishing: bool = False) -> bool:
        """Begin, register a window, or pass a break; returns whether one of them was possible."""
        ready = self._ready_until(finishing=finishing)
        if ready is None:
            return False
        if isinstance(self._phase, Waiting):
            return self._begin(ready, finishing=finishing)
        return self._step(self._phase, ready, finishing=finishing)

    @property
    def current(self) -> Snapshot | None:
        """What the pass under way knows now; None until it has registered a window."""
        phase = self._phase
        if isinstance(phase, Waiting) or not phase.under_way.windows:
            return None
        now = phase.under_way.snapshot()
        passes = [*self._before, now]
        return Snapshot(
            now, len(passes), partial(self._estimate, passes, [*self._breaks], self._first_turn)
        )

    def result(self) -> Estimate:
        """Finish with what was fed so far.

        Raises
        ------
        NotEnoughDataError
            There is no second of lidar data.
        """
        found = super().result()
        lidar, imu = self.buffer.lidar_span, self.buffer.imu_span
        if lidar is None or imu is None or lidar[1] <= imu[1] + MAX_IMU_GAP:
            return found
        left_out = Break("inertial", imu[1], lidar[1], "left out")
        return replace(found, breaks=[*found.breaks, left_out])

    def so_far(self) -> Estimate:
        """Return what the windows registered so far say.

        Raises
        ------
        NotEnoughDataError
            There is none yet.
        """
        passes, shift = [*self._before], self.settings.shift
        if not isinstance(self._phase, Waiting):
            now, shift = self._phase.under_way, self._phase.under_way.settings.shift
            if now.windows and now.length >= shift:
                passes.append(now)
        if not passes:
            raise NotEnoughDataError(_too_short(shift, self._breaks, self.buffer))
        return self._estimate(passes, self._breaks, self._first_turn)

    @property
    def _first_turn(self) -> float:
        """When the head of a 2D lidar had turned once, s; the start if there is no such time."""
        return (self._spin.first_turn if self._is_planar else None) or 0.0

    def _estimate(
        self, passes: list[OdometryPass], breaks: list[Break], first_turn: float
    ) -> Estimate:
        return estimate_of(
            passes,
            self._described,
            breaks,
            first_turn=first_turn,
            payload=self._payload,
            has_imu=self._has_imu,
        )

    def _ready_until(self, *, finishing: bool) -> float | None:
        """Return the time up to which lidar and IMU data are complete, s."""
        lidar, imu = self.buffer.lidar_span, self.buffer.imu_span
        if lidar is None:
            return None
        if imu is None:
            return lidar[1]
        return min(lidar[1], imu[1] + MAX_IMU_GAP if finishing else imu[1] - 2 * MARGIN)

    def _begin(self, ready: float, *, finishing: bool) -> bool:
        """Begin a pass once enough has been seen; returns whether it was."""
        payload, settings = self._payload, self.settings
        beginning = find_beginning(self.buffer, payload, settings, ready=ready, finishing=finishing)
        if beginning is None:
            return False
        before = self._before[-1] if self._before else None
        begun = begin_pass(beginning, payload, before, self._threads)
        if beginning.start.static is not None and settings.n_views:
            begun.look_around(self.buffer)
        self._phase = Running(begun)
        return True

    def _step(self, phase: Begun, ready: float, *, finishing: bool) -> bool:
        """Register the next window if its data is complete; returns whether it was."""
        now, broken = phase.under_way, self.buffer.first_break()
        if broken is not None and broken.start <= ready:
            ready, finishing = broken.start, True
        else:
            broken = None
        end = now.end + _new_data(phase)
        if end > ready:
            if not finishing:
                return False
            if ready - now.end < DT:
                return self._judge(phase) or self._bridge(now, broken)
            end = ready
        phase = self._watch_head(phase, end)
        now.step(self.buffer, end)
        self._settle(phase, end)
        return True

    def _settle(self, phase: Begun, end: float) -> None:
        """Judge a bridge when enough was seen behind it, and forget what no window needs."""
        needed = end
        if isinstance(phase, Bridging):
            if end >= phase.broken.stop + JUDGED[1]:
                self._judge(phase)
                return
            needed = min(end, phase.broken.stop)
        self.buffer.forget(needed - phase.under_way.settings.window - 1.0)

    def _bridge(self, now: OdometryPass, broken: Break | None) -> bool:
        """Go on over a break as if it were none; returns whether there is one."""
        if broken is None:
            return False
        self._phase = Bridging(now, now.snapshot(), broken)
        self.buffer.pass_over(broken)
        return True

    def _watch_head(self, phase: Begun, end: float) -> Begun:
        """Remember the pass when the head comes to stand; after long, ask whether it found back.

        Parameters
        ----------
        end : s, of the next window; nothing later counts, so that live use and recordings agree
        """
        stalls = self._spin.stalls(end) if self._is_planar else []
        if isinstance(phase, Bridging) or not stalls:
            return phase
        now, (start, stop) = phase.under_way, stalls[-1]
        is_known = isinstance(phase, Stalled) and phase.since == start
        if not is_known and (stop is None or stop > now.end):
            phase = Stalled(now, now.snapshot(), start)
        if isinstance(phase, Stalled) and stop is not None:
            lasted = stop - start >= LOST_AFTER
            phase = (
                Bridging(now, phase.before, Break(HEAD, start, stop)) if lasted else Running(now)
            )
        self._phase = phase
        return phase

    def _judge(self, phase: Begun) -> bool:
        """Begin anew after the last break if its far side does not fit; returns whether so."""
        if not isinstance(phase, Bridging):
            return False
        broken = phase.broken
        if found_again(phase.under_way.windows, broken):
            self._breaks.append(replace(broken, outcome="bridged"))
            self._phase = Running(phase.under_way)
            return False
        self._breaks.append(broken)
        self.buffer.cut(broken.stop)
        if phase.before.windows:
            self._before.append(phase.before)
        self._phase = Waiting()
        return True


def _new_data(phase: Begun) -> float:
    """How much of it the next window takes, s: little as long as the motion is a guess."""
    now = phase.under_way
    guessed = now.is_settling or isinstance(phase, Bridging)
    return now.settings.shift / (CAREFUL_STEPS if guessed else 1)


def _too_short(least: float, breaks: list[Break], buffer: BatchBuffer) -> str:
    if not breaks:
        held = f"lidar points {_span(buffer.lidar_span)}, inertial samples {_span(buffer.imu_span)}"
        return f"less than {least:g} s that can be estimated: {held}"
    first = breaks[0]
    return (
        f"no stretch of {least:g} s without a break, so that nothing can be estimated: {len(breaks)} "
        f"breaks, the first of the {first.sensor} data from {first.start:.2f} to {first.stop:.2f} s"
    )


def _span(span: tuple[float, float] | None) -> str:
    return "none" if span is None else f"from {span[0]:.2f} to {span[1]:.2f} s"
