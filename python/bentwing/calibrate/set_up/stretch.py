# SPDX-License-Identifier: MIT OR Apache-2.0
"""The part of a recording from which its set-up is found: some seconds with motion, in memory."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording import imu_units
from bentwing.recording.batches import EncoderBatch, ImuBatch, LidarBatch
from bentwing.recording.preprocess import preprocess
from bentwing.recording.readings import ImuReading, LidarReading

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bentwing.recording import Batch, Payload, Recording

LENGTH = 20.0  # s: some turns of a slow head, and its start
BEFORE_MOTION = 3.0  # s of rest that begin it: how the motion begins shows the clocks
SEARCHED = 600.0  # s in which motion is looked for
MOVING = 0.15  # rad/s away from the first half second
MOST_POINTS = 100_000  # a second; more would only take time
AROUND = 0.5  # s of the IMU and the encoder before and after a part
GAP = 0.5  # s; what was recorded on both sides of a longer one is not compared with each other
ENOUGH = 10.0  # s up to a gap


@dataclass(frozen=True, slots=True)
class Stretch:
    """Some seconds of a recording.

    Attributes
    ----------
    batches : in the order of the recording, the lidar's thinned
    imu_offset : s, what has been added to the stamps of the IMU
    """

    batches: tuple[Batch, ...]
    imu_offset: float = 0.0

    @property
    def imu(self) -> ImuBatch:
        """All inertial samples; none without an IMU."""
        return ImuBatch.joined([b for b in self.batches if isinstance(b, ImuBatch)])

    @property
    def lidar(self) -> LidarBatch:
        """All points; none where the lidar saw nothing."""
        parts = [b for b in self.batches if isinstance(b, LidarBatch)]
        return LidarBatch.joined(parts) if parts else LidarBatch(np.empty((0, 3)), np.empty(0))

    @property
    def encoder(self) -> EncoderBatch | None:
        """All angles of the motor; None without one."""
        parts = [b for b in self.batches if isinstance(b, EncoderBatch)]
        if not parts:
            return None
        return EncoderBatch(
            np.concatenate([b.times for b in parts]), np.concatenate([b.angles for b in parts])
        )

    def with_encoder(self, angles: EncoderBatch) -> Stretch:
        """Return the same with other angles of the motor, each as soon as the lidar needs it."""
        batches: list[Batch] = []
        first = 0
        for batch in self.batches:
            if isinstance(batch, EncoderBatch):
                continue
            if isinstance(batch, LidarBatch) and len(batch.times):
                last = int(np.searchsorted(angles.times, batch.times[-1] + AROUND))
                if last > first:
                    part = slice(first, last)
                    batches.append(EncoderBatch(angles.times[part], angles.angles[part]))
                first = max(first, last)
            batches.append(batch)
        return replace(self, batches=tuple(batches))

    @property
    def without_imu(self) -> Stretch:
        """The same without inertial samples."""
        return replace(self, batches=tuple(b for b in self.batches if not isinstance(b, ImuBatch)))

    def with_gyro_scaled(self, factor: float) -> Stretch:
        """Return the same with the rates of the gyro multiplied by a factor."""
        batches = tuple(
            replace(batch, gyro=factor * batch.gyro) if isinstance(batch, ImuBatch) else batch
            for batch in self.batches
        )
        return replace(self, batches=batches)

    def read_as(self, payload: Payload) -> Stretch:
        """Return the samples as a payload reads those that drivers give, the encoder's apart."""
        lidar, imu = LidarReading.of(payload.lidar), ImuReading.of(payload.imu)
        offset = _imu_offset(payload)
        later = offset - self.imu_offset

        def read(batch: Batch) -> Batch:
            if isinstance(batch, LidarBatch):
                points = lidar.batch(batch)
                return replace(points, times=batch.times - payload.lidar.latency_read)
            if isinstance(batch, EncoderBatch):
                return replace(batch, times=batch.times - payload.lidar.latency_read)
            gyro, accel = imu.gyro.vectors(batch.gyro), imu.accel.vectors(batch.accel)
            return replace(batch, times=batch.times + later, gyro=gyro, accel=accel)

        batches = [read(batch) for batch in self.batches]
        if later:
            batches.sort(key=lambda batch: batch.times[0])
        return Stretch(tuple(batches), offset)

    def part(self, start: float, stop: float) -> Stretch:
        """Return what lies in `[start, stop)`, s, with a little more of the motor and the IMU."""
        parts = (_trimmed(batch, start, stop) for batch in self.batches)
        return replace(self, batches=tuple(part for part in parts if len(part.times)))

    def preprocessed(self, payload: Payload) -> Iterator[Batch]:
        """Yield the batches as an estimator takes them."""
        return preprocess(iter(self.batches), payload, Counter())


def read_stretch(recording: Recording, after: float = 0.0) -> Stretch:
    """Read the first seconds in which the IMU moves, after some; without an IMU the first seconds."""
    start = max(after, _first_motion(recording, after) - BEFORE_MOTION)
    thinning = _Thinning()
    batches = [
        thinning.thinned(batch) if isinstance(batch, LidarBatch) else batch
        for batch in recording.batches(start or None, LENGTH)
    ]
    whole = Stretch(
        tuple(batch for batch in batches if len(batch.times)), _imu_offset(recording.payload)
    )
    return _without_gaps(whole)


def _without_gaps(whole: Stretch) -> Stretch:
    """Return the part before the first gap if that is enough, else the longest part between gaps."""
    starts, ends = zip(
        *(_gaps(times) for times in (whole.lidar.times, whole.imu.times)), strict=True
    )
    if not len(whole.lidar.times) or not sum(map(len, starts)):
        return whole
    order = np.argsort(np.concatenate(starts))
    stops, resumes = (np.concatenate(sides)[order] for sides in (starts, ends))
    first, last = whole.lidar.times[0], whole.lidar.times[-1]
    parts = list(zip([first, *resumes], [*stops, last], strict=True))
    lengths = [stop - start for start, stop in parts]
    chosen = 0 if lengths[0] >= ENOUGH else int(np.argmax(lengths))
    return whole.part(*parts[chosen])


def _gaps(times: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return beginnings and ends (K,), s, of what is missing of times (N,)."""
    is_gap = np.diff(times) > GAP
    return times[:-1][is_gap], times[1:][is_gap]


def _imu_offset(payload: Payload) -> float:
    return 0.0 if payload.imu is None else payload.imu.clock_offset


def _first_motion(recording: Recording, after: float) -> float:
    samples = imu_units.collect(recording.imu_batches(), after + SEARCHED)
    later = samples[0] >= after
    times, gyro, accel = (values[later] for values in samples)
    if len(times) < imu_units.MIN_SAMPLES:
        return after
    n = int(np.searchsorted(times, times[0] + imu_units.CHECKED))
    rates = gyro * imu_units.gyro_scale(times[:n], gyro[:n], accel[:n])
    resting = np.median(rates[times < times[0] + 0.5], axis=0)
    moves = np.linalg.norm(rates - resting, axis=1) > MOVING
    return float(times[int(np.argmax(moves))]) if moves.any() else after


class _Thinning:
    """Keep every k-th point, so that no more are kept than `MOST_POINTS` a second."""

    def __init__(self) -> None:
        self._seen = 0
        self._first: float | None = None
        self._step = 1

    def thinned(self, batch: LidarBatch) -> LidarBatch:
        if not len(batch.times):
            return batch
        if self._first is None:
            self._first = float(batch.times[0])
        self._seen += len(batch.times)
        if (seconds := float(batch.times[-1]) - self._first) > 0.5:
            self._step = max(1, round(self._seen / seconds / MOST_POINTS))
        return batch if self._step == 1 else batch.where(slice(None, None, self._step))


def _trimmed(batch: Batch, start: float, stop: float) -> Batch:
    margin = 0.0 if isinstance(batch, LidarBatch) else AROUND
    keep: NDArray[np.bool_] = (batch.times >= start - margin) & (batch.times < stop + margin)
    if isinstance(batch, EncoderBatch):
        return replace(batch, times=batch.times[keep], angles=batch.angles[keep])
    return batch.where(keep)
