# SPDX-License-Identifier: MIT OR Apache-2.0
"""The continuous-time estimator: a sliding window of surfel registration (Kaul 2015, section 2)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bentwing.base.breaks import HEAD, Break
from bentwing.base.errors import NotEnoughDataError
from bentwing.base.trajectory import DT
from bentwing.odometry.buffer import BatchBuffer
from bentwing.odometry.continuous.beginning import Situation, begin_pass
from bentwing.odometry.continuous.core_settings import CoreSettings
from bentwing.odometry.continuous.odometry_pass import MARGIN, OdometryPass
from bentwing.odometry.continuous.outcome import estimate_of
from bentwing.odometry.continuous.planar import is_plane
from bentwing.odometry.continuous.settings import ContinuousSettings
from bentwing.odometry.continuous.standstill import SpinWatch
from bentwing.odometry.segments import JUDGED, MAX_IMU_GAP, found_again
from bentwing.odometry.stall import LOST_AFTER
from bentwing.odometry.start import Start, find_start, level_start
from bentwing.recording import LidarBatch
from bentwing.recording.described import described_mount

if TYPE_CHECKING:
    from bentwing.base.estimate import Estimate
    from bentwing.recording import Batch, Payload

# A rest shorter than this is waited out before the start is judged, s.
LOOK_AHEAD = 6.0
# At the beginning and behind a break the motion is a guess that must not grow until the lidar corrects
# it: so many windows instead of one.
CAREFUL_STEPS = 3


class Continuous:
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
        self.settings = settings or ContinuousSettings()
        self._payload = payload
        self._mount = described_mount(payload)
        self._threads = threads or 0
        self._sliding = self.settings
        self._core = CoreSettings.of(self.settings.registration, payload, DT)
        self._buffer = BatchBuffer()
        self._start: Start | None = None
        self._first = 0.0
        self._pass: OdometryPass | None = None
        # What came before the last break.
        self._before: list[OdometryPass] = []
        # The pass as it was at a break, while it is not known whether it can be continued.
        self._bridged: tuple[OdometryPass, Break] | None = None
        # Whether the lidar is a 2D one, which sees single planes when its head stands still; the pass as
        # it was when the head came to stand, and since when it stands.
        self._is_planar = True
        self._spin = SpinWatch(by_encoder=payload.encoder is not None)
        self._stalled: tuple[OdometryPass, float] | None = None
        self._breaks: list[Break] = []

    def feed(self, batch: Batch) -> None:
        """Take the next batch; windows that have become complete are registered."""
        self.take(batch)
        self._advance(finishing=False)

    def take(self, batch: Batch) -> None:
        """Hold the next batch for `step`."""
        self._buffer.add(batch)
        if not len(batch.times):
            return
        if self._is_planar and isinstance(batch, LidarBatch) and len(batch.times) >= 3:
            self._is_planar = is_plane(batch.points)
        self._spin.add(batch)

    def step(self, *, finishing: bool = False) -> OdometryPass | None:
        """Register one window that has become complete; returns its pass, None without any.

        The result is that of `feed`; `finishing` as `result` does.
        """
        while self._go_on(finishing=finishing):
            if self._pass is not None:
                return self._pass
        return None

    def result(self) -> Estimate:
        """Finish with what was fed so far.

        Raises
        ------
        NotEnoughDataError
            There is no second of lidar data.
        """
        self._advance(finishing=True)
        found = self.so_far()
        lidar, imu = self._buffer.lidar_span, self._buffer.imu_span
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
        done = self._pass
        if done is None or not done.windows or done.end - self._first < self._sliding.shift:
            if not self._before:
                msg = (
                    f"less than {self._sliding.shift:g} s of lidar points; nothing can be estimated"
                )
                raise NotEnoughDataError(msg)
            return estimate_of(self._before, self._mount, self._breaks)
        return self.estimate(done)

    @property
    def current(self) -> OdometryPass | None:
        """The pass that is under way."""
        return self._pass

    @property
    def buffer(self) -> BatchBuffer:
        """What coming windows may need of the batches."""
        return self._buffer

    def _advance(self, *, finishing: bool) -> None:
        while self._go_on(finishing=finishing):
            pass

    def _go_on(self, *, finishing: bool) -> bool:
        """Do what can be done next: begin, register a window, pass a break; returns whether so."""
        ready = self._ready_until(finishing=finishing)
        if ready is None or (self._start is None and not self._begin(ready, finishing=finishing)):
            return False
        return self._step(ready, finishing=finishing)

    def _ready_until(self, *, finishing: bool) -> float | None:
        """Return the time up to which lidar and IMU data are complete, s."""
        lidar, imu = self._buffer.lidar_span, self._buffer.imu_span
        if lidar is None:
            return None
        if imu is None:
            return lidar[1]
        return min(lidar[1], imu[1] + MAX_IMU_GAP if finishing else imu[1] - 2 * MARGIN)

    def _begin(self, ready: float, *, finishing: bool) -> bool:
        """Find the start once enough has been seen; returns whether it was."""
        lidar, imu = self._buffer.lidar_span, self._buffer.imu_span
        if lidar is None or (ready - lidar[0] < LOOK_AHEAD and not finishing):
            return False
        self._first = lidar[0]
        if imu is None or self._payload.imu is None:
            self._start = level_start(lidar[0])
            self._sliding = self.settings.without_imu()
        else:
            # The trajectory begins with the later of both sensors.
            self._first = max(lidar[0], imu[0] + 2 * DT)
            begin = self._buffer.imu(imu[0], imu[1] + 1.0)
            start = find_start(begin, self._payload.imu)
            still_resting = start.static is not None and start.hold >= imu[1] - 1.0
            if still_resting and not finishing:
                return False
            self._start = start
        self._pass = self._new_pass(self._start)
        return True

    def _new_pass(self, start: Start) -> OdometryPass:
        begun = begin_pass(
            Situation(
                self._payload,
                self._mount,
                self._sliding,
                self._core,
                self._threads,
                has_imu=self._buffer.has_imu,
            ),
            start,
            self._first,
            before=self._before[-1] if self._before else None,
        )
        if start.static is not None and self.settings.n_views:
            begun.look_around(self._buffer)
        return begun

    def _step(self, ready: float, *, finishing: bool) -> bool:
        """Register the next window if its data is complete; returns whether it was."""
        current, broken = self._pass, self._break_until(ready)
        if current is None:
            return False
        if broken is not None:
            ready, finishing = broken.start, True
        end = current.end + self._new_data
        if end > ready:
            if not finishing:
                return False
            if ready - current.end < DT:
                return self._judge_bridge() or self._bridge(current, broken)
            end = ready
        self._watch_head(current, end)
        current.step(self._buffer, end)
        self._settle(end)
        return True

    @property
    def _new_data(self) -> float:
        """How much of it the next window takes, s: little as long as the motion is a guess."""
        settling = self._pass is not None and self._pass.is_settling
        guessed = settling or self._bridged is not None
        return self._sliding.shift / (CAREFUL_STEPS if guessed else 1)

    def _settle(self, end: float) -> None:
        """Judge a bridge when enough was seen behind it, and forget what no window needs."""
        if self._bridged is not None and end >= self._bridged[1].stop + JUDGED[1]:
            self._judge_bridge()
        else:
            needed = end if self._bridged is None else min(end, self._bridged[1].stop)
            self._buffer.forget(needed - self._sliding.window - 1.0)

    def _break_until(self, ready: float) -> Break | None:
        broken = self._buffer.first_break()
        return broken if broken is not None and broken.start <= ready else None

    def _bridge(self, current: OdometryPass, broken: Break | None) -> bool:
        """Go on over a break as if it were none; returns whether there is one."""
        if broken is None:
            return False
        self._bridged = current.snapshot(), broken
        self._buffer.pass_over(broken)
        return True

    def _watch_head(self, current: OdometryPass, end: float) -> None:
        """Remember the pass when the head comes to stand; after long, ask whether it found back.

        Parameters
        ----------
        end : s, of the next window; nothing later counts, so that live use and recordings agree
        """
        if not self._is_planar or self._bridged is not None:
            return
        stalls = self._spin.stalls(end)
        if not stalls:
            return
        start, stop = stalls[-1]
        is_new = self._stalled is None or self._stalled[1] != start
        if is_new and (stop is None or stop > current.end):
            self._stalled = current.snapshot(), start
        if stop is None or self._stalled is None:
            return
        before, self._stalled = self._stalled[0], None
        if stop - start >= LOST_AFTER:
            self._bridged = before, Break(HEAD, start, stop)

    def _judge_bridge(self) -> bool:
        """Begin anew after the last break if its far side does not fit; returns whether so."""
        if self._bridged is None or self._pass is None:
            return False
        (before, broken), self._bridged, self._stalled = self._bridged, None, None
        found = found_again(self._pass.windows, broken)
        self._breaks.append(replace(broken, outcome="bridged") if found else broken)
        if found:
            return False
        self._buffer.cut(broken.stop)
        if before.windows:
            self._before.append(before)
        self._start = self._pass = None
        return True

    def estimate(self, last: OdometryPass) -> Estimate:
        """Return what the passes before the last break and this one say, levelled."""
        return estimate_of([*self._before, last], self._mount, self._breaks)
