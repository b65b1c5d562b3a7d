# SPDX-License-Identifier: MIT OR Apache-2.0
"""Give every point of a motor-turned lidar the motor's angle at its time."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.preprocess.smooth_angles import SmoothAngles

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bentwing.recording.batches import EncoderBatch, LidarBatch

MAX_GAP = 0.25  # s between angles; over more the motor's speed cannot be taken as constant
MAX_HELD = 2.0  # s of points that wait for angles; then the encoder counts as silent
HISTORY = 1.0  # s of angles kept before the oldest waiting point


class EncoderAngles:
    """Hold lidar batches back until the encoder covers them, then attach the angles.

    Parameters
    ----------
    counts : receives `preprocess.no_encoder_angle`, points dropped for lack of an angle
    delay : s, the angle at a stamp of the lidar is that of this much earlier
    """

    def __init__(self, counts: Counter[str], delay: float = 0.0) -> None:
        self._counts = counts
        self._delay = delay
        self._times = np.zeros(0)
        self._angles = np.zeros(0)
        self._waiting: deque[LidarBatch] = deque()
        self._smooth = SmoothAngles()

    def add_encoder(self, batch: EncoderBatch) -> Iterator[LidarBatch]:
        """Take the next angles; yield the batches they complete."""
        usable = self._smooth.add(batch)
        if usable is not None:
            yield from self._add(usable)

    def _add(self, batch: EncoderBatch) -> Iterator[LidarBatch]:
        self._times = np.concatenate([self._times, batch.times + self._delay])
        self._angles = np.concatenate([self._angles, batch.angles])
        yield from self._release(float(self._times[-1]))
        self._forget()

    def add_lidar(self, batch: LidarBatch) -> Iterator[LidarBatch]:
        """Take the next points; yield the batches that need not wait any longer."""
        self._waiting.append(batch)
        covered = float(self._times[-1]) if len(self._times) else -np.inf
        yield from self._release(max(covered, float(batch.times[-1]) - MAX_HELD))

    def finish(self) -> Iterator[LidarBatch]:
        """Yield what still waits, as far as it is covered."""
        if (rest := self._smooth.finish()) is not None:
            yield from self._add(rest)
        yield from self._release(np.inf)

    def _release(self, until: float) -> Iterator[LidarBatch]:
        while self._waiting and self._waiting[0].times[-1] <= until:
            batch = self._with_angles(self._waiting.popleft())
            if len(batch.times):
                yield batch

    def _with_angles(self, batch: LidarBatch) -> LidarBatch:
        keep = _covered(batch.times, self._times)
        self._counts["preprocess.no_encoder_angle"] += int((~keep).sum())
        if not keep.all():
            batch = batch.where(keep)
        if not len(batch.times):
            return batch
        return replace(batch, angles=np.interp(batch.times, self._times, self._angles))

    def _forget(self) -> None:
        """Drop angles that no waiting or coming point can need, to bound the memory."""
        oldest = self._waiting[0].times[0] if self._waiting else self._times[-1]
        first = int(np.searchsorted(self._times, oldest - HISTORY - MAX_HELD))
        self._times, self._angles = self._times[first:], self._angles[first:]


def _covered(times: NDArray[np.float64], stamps: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which times lie between two stamps that are close to each other."""
    if len(stamps) < 2:
        return np.zeros(len(times), dtype=np.bool_)
    right = np.clip(np.searchsorted(stamps, times, side="right"), 1, len(stamps) - 1)
    within = (times >= stamps[0]) & (times <= stamps[-1])
    return np.asarray(within & (stamps[right] - stamps[right - 1] <= MAX_GAP))
