# SPDX-License-Identifier: MIT OR Apache-2.0
"""From the raw messages of one topic to batches: one stream each for IMU, encoder and lidar."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bentwing.recording.batches import EncoderBatch, ImuBatch
from bentwing.recording.messages import wire
from bentwing.recording.stamps import StampMonitor

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.clock import Clock
    from bentwing.recording.batches import Batch
    from bentwing.recording.clock_steps import ClockSteps
    from bentwing.recording.readings import EncoderReading, ImuReading

RawMessage = tuple[int, bytes]  # recorder's time in ns, bytes
MAX_ENCODER_ANGLE = 1e6  # rad; more is damage
MAX_IMU_VALUE = 1e6  # rad/s or m/s²; more is damage


class Stream(Protocol):
    """One topic on its way to batches; made anew for every pass over the recording."""

    counts: Counter[str]
    monitor: StampMonitor

    def foresee(self, recorder_ns: int, raw: bytes) -> int | None:
        """Take a message that `decode` will get later, for the clock of the stream.

        Returns how many of the messages that wait for `decode` it comes before; None if `decode` need
        not get it.
        """

    def decode(self, messages: Sequence[RawMessage]) -> Batch | None:
        """Return the batch of the next messages, if anything of them can be handed out yet."""

    def finish(self) -> Batch | None:
        """Return what was held back."""


class ImuStream:
    """sensor_msgs/Imu."""

    def __init__(
        self,
        topic: str,
        clock: Clock,
        reading: ImuReading,
        *,
        cdr: bool,
        use_recorder_time: bool,
        steps: ClockSteps,
    ) -> None:
        self.counts: Counter[str] = Counter()
        self.monitor = StampMonitor(
            topic,
            use_recorder_time=use_recorder_time,
            counts=self.counts,
            offset_ns=reading.offset_ns,
            steps=steps,
        )
        self._clock, self._reading, self._cdr = clock, reading, cdr

    def foresee(self, recorder_ns: int, raw: bytes) -> int | None:
        """Take a message that `decode` will get later."""
        try:
            return self.monitor.foresee(wire.stamp_ns(raw, cdr=self._cdr), recorder_ns, raw)
        except wire.BrokenMessageError:
            return 0

    def decode(self, messages: Sequence[RawMessage]) -> ImuBatch | None:
        """Return the samples of the next messages."""
        stamps_ns, bodies = [], []
        for recorder_ns, raw in messages:
            try:
                header_ns, body = wire.imu(raw, cdr=self._cdr)
            except wire.BrokenMessageError:
                self.counts["broken_messages"] += 1
                continue
            stamp_ns = self.monitor.accept(header_ns, recorder_ns)
            if stamp_ns is not None:
                stamps_ns.append(stamp_ns)
                bodies.append(body)
        self.counts["samples"] += len(stamps_ns)
        values = np.frombuffer(b"".join(bodies), "<f8").reshape(-1, 37).astype(np.float64)
        gyro = self._reading.gyro.vectors(values[:, 13:16])
        accel = self._reading.accel.vectors(values[:, 25:28])
        keep = usable_samples(gyro, accel, self.counts)
        if not keep.any():
            return None
        times = self._clock.to_seconds(np.array(stamps_ns, dtype=np.int64)[keep])
        return ImuBatch(times, np.ascontiguousarray(gyro[keep]), np.ascontiguousarray(accel[keep]))

    def finish(self) -> None:
        """Nothing is held back."""


def usable_samples(
    gyro: NDArray[np.float64], accel: NDArray[np.float64], counts: Counter[str]
) -> NDArray[np.bool_]:
    """Return which samples (M,) can be meant, and count `nan` and `out_of_range`."""
    both = np.hstack([gyro, accel])
    is_finite = np.isfinite(both).all(axis=1)
    counts["nan"] += int((~is_finite).sum())
    with np.errstate(invalid="ignore"):
        is_small = (np.abs(both) < MAX_IMU_VALUE).all(axis=1)
    counts["out_of_range"] += int((is_finite & ~is_small).sum())
    return np.asarray(is_finite & is_small)


class EncoderStream:
    """The position of one joint of JointState or /tf, unwrapped over the whole pass."""

    def __init__(
        self,
        topic: str,
        clock: Clock,
        reading: EncoderReading,
        *,
        cdr: bool,
        use_recorder_time: bool,
        steps: ClockSteps,
    ) -> None:
        self.counts: Counter[str] = Counter()
        self.monitor = StampMonitor(
            topic,
            use_recorder_time=use_recorder_time,
            counts=self.counts,
            offset_ns=reading.offset_ns,
            steps=steps,
        )
        self._clock, self._reading, self._cdr = clock, reading, cdr
        self._last_angle: float | None = None

    def foresee(self, recorder_ns: int, raw: bytes) -> int | None:
        """Take a message that `decode` will get later."""
        try:
            header_ns, angle = self._reading.read(raw, cdr=self._cdr)
        except wire.BrokenMessageError:
            return 0
        if angle is None:
            return 0
        return self.monitor.foresee(header_ns, recorder_ns, raw)

    def decode(self, messages: Sequence[RawMessage]) -> EncoderBatch | None:
        """Return the angles of the next messages."""
        stamps_ns, angles = [], []
        for recorder_ns, raw in messages:
            try:
                header_ns, angle = self._reading.read(raw, cdr=self._cdr)
            except wire.BrokenMessageError:
                self.counts["broken_messages"] += 1
                continue
            if angle is None:  # several drivers may share a topic, each with joints of its own
                self.counts["other_joints"] += 1
                continue
            if not abs(angle) < MAX_ENCODER_ANGLE:
                self.counts["nan"] += 1
                continue
            stamp_ns = self.monitor.accept(header_ns, recorder_ns)
            if stamp_ns is not None:
                stamps_ns.append(stamp_ns)
                angles.append(angle)
        self.counts["samples"] += len(stamps_ns)
        if not stamps_ns:
            return None
        first = [] if self._last_angle is None else [self._last_angle]
        turned = self._reading.angles(np.array(angles))
        unwrapped = np.unwrap(np.concatenate([first, turned]))[len(first) :]
        self._last_angle = float(unwrapped[-1])
        return EncoderBatch(self._clock.to_seconds(np.array(stamps_ns, dtype=np.int64)), unwrapped)

    def finish(self) -> None:
        """Nothing is held back."""
