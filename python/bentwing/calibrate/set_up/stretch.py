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

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from bentwing.recording import Batch, Payload, Recording

LENGTH = 20.0  # s: some turns of a slow head, and its start
BEFORE_MOTION = 3.0  # s of rest that begin it: how the motion begins shows the clocks
SEARCHED = 600.0  # s in which motion is looked for
MOVING = 0.15  # rad/s away from the first half second
MOST_POINTS = 100_000  # a second; more would only take time
UNCERTAIN = 1.5  # s by which the clocks may differ: that much more of the IMU is read on both sides


@dataclass(frozen=True, slots=True)
class Stretch:
    """Some seconds of a recording as its payload reads them.

    Attributes
    ----------
    batches : in the order of the recording, the lidar's thinned
    """

    batches: tuple[Batch, ...]

    @property
    def imu(self) -> ImuBatch:
        """All inertial samples; none without an IMU."""
        parts = [b for b in self.batches if isinstance(b, ImuBatch)]
        if not parts:
            return ImuBatch(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))
        return ImuBatch(
            np.concatenate([b.times for b in parts]),
            np.concatenate([b.gyro for b in parts]),
            np.concatenate([b.accel for b in parts]),
        )

    @property
    def lidar(self) -> tuple[LidarBatch, ...]:
        """The batches of the lidar."""
        return tuple(b for b in self.batches if isinstance(b, LidarBatch))

    @property
    def encoder(self) -> EncoderBatch | None:
        """All angles of the motor; None without one."""
        parts = [b for b in self.batches if isinstance(b, EncoderBatch)]
        if not parts:
            return None
        return EncoderBatch(
            np.concatenate([b.times for b in parts]), np.concatenate([b.angles for b in parts])
        )

    @property
    def span(self) -> tuple[float, float]:
        """First and last stamp of the lidar, s."""
        lidar = self.lidar
        return float(lidar[0].times[0]), float(lidar[-1].times[-1])

    def part(self, start: float, stop: float) -> Stretch:
        """Return what lies in `[start, stop)`, s, with a little more of the motor and the IMU."""
        return Stretch(tuple(_trimmed(self.batches, start, stop)))

    def preprocessed(self, payload: Payload) -> Iterator[Batch]:
        """Yield the batches as an estimator takes them."""
        return preprocess(iter(self.batches), payload, Counter())


def read_stretch(recording: Recording, length: float = LENGTH) -> Stretch:
    """Read the first seconds in which the IMU moves; without an IMU the first seconds."""
    start = max(0.0, _first_motion(recording) - BEFORE_MOTION)
    thinning = _Thinning()
    batches = recording.batches(start or None, length + UNCERTAIN)
    return Stretch(
        tuple(thinning.thinned(b) if isinstance(b, LidarBatch) else b for b in batches)
    )


def _first_motion(recording: Recording) -> float:
    times, gyro, _ = imu_units.collect(recording.imu_batches(), SEARCHED)
    if len(times) < imu_units.MIN_SAMPLES:
        return 0.0
    scaled = gyro * imu_units.gyro_scale(*imu_units.collect(recording.imu_batches()))
    resting = np.median(scaled[times < times[0] + 0.5], axis=0)
    moves = np.linalg.norm(scaled - resting, axis=1) > MOVING
    return float(times[int(np.argmax(moves))]) if moves.any() else 0.0


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


def _trimmed(batches: Sequence[Batch], start: float, stop: float) -> Iterator[Batch]:
    for batch in batches:
        margin = 0.0 if isinstance(batch, LidarBatch) else 0.5
        keep = (batch.times >= start - margin) & (batch.times < stop + margin)
        if not keep.any():
            continue
        if isinstance(batch, EncoderBatch):
            yield replace(batch, times=batch.times[keep], angles=batch.angles[keep])
        else:
            yield batch.where(keep)
