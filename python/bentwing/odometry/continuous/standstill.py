# SPDX-License-Identifier: MIT OR Apache-2.0
"""When the head of a 2D lidar stands still, so that single planes are all it sees.

The definition of a stall is that of `bentwing info` and of the warning in flight; the usual rate is what
the head has done so far.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.odometry.stall import BIN, MIN_STALL, STALLED, TURNING
from bentwing.recording.batches import EncoderBatch, ImuBatch

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording.batches import Batch

# A median above it is a head that turns, rad/s; slower is the carrier's own motion.
SPINNING = 1.5
# A median below it is a head at rest with a bias, rad/s.
_AT_REST = 0.1
# A head has a usual rate when it has turned for so many bins, 5 s.
_FEWEST = 20


@dataclass(slots=True)
class _Bins:
    """Those of a stall: the first one, and the first one after it, once it has ended."""

    first: int
    after: int | None = None


class SpinWatch:
    """Medians of the rate of turn in bins, and where they are slow.

    Parameters
    ----------
    by_encoder : whether an encoder tells the rate; else the gyro, which turns with the head

    Attributes
    ----------
    first_turn : s, when the head had turned once around; None before
    """

    def __init__(self, *, by_encoder: bool) -> None:
        self._by_encoder = by_encoder
        self._bin: int | None = None
        self._rates: list[NDArray[np.float64]] = []
        self._angle: tuple[float, float] | None = None
        self._moving: list[float] = []
        self._stalls: list[_Bins] = []
        self._turning = False
        self._turned = 0.0
        self.first_turn: float | None = None

    def add(self, batch: Batch) -> None:
        """Take the next batch; only those of the sensor that tells the rate count."""
        if isinstance(batch, EncoderBatch) and self._by_encoder:
            times, angles = batch.times, batch.angles
            if self._angle is not None:
                times = np.append(self._angle[0], times)
                angles = np.append(self._angle[1], angles)
            self._angle = float(times[-1]), float(angles[-1])
            rates = np.abs(np.diff(angles)) / np.maximum(np.diff(times), 1e-9)
            self._take(times[1:], rates)
        elif isinstance(batch, ImuBatch) and not self._by_encoder:
            self._take(batch.times, np.linalg.norm(batch.gyro, axis=1))

    def stalls(self, until: float) -> list[tuple[float, float | None]]:
        """Return the stalls that had begun by a time, s: start, and end if that was by then, too.

        What is said of a time does not change with what is added later.
        """
        found: list[tuple[float, float | None]] = []
        for first, after in ((bins.first, bins.after) for bins in self._stalls):
            start, known = first * BIN, first * BIN + MIN_STALL
            if known > until:
                break
            ends = after is not None and (after + 1) * BIN <= until
            stop = after * BIN if after is not None and ends else None
            if after is not None and after * BIN - start < MIN_STALL:
                continue
            found.append((start, stop))
        return found

    def _take(self, times: NDArray[np.float64], rates: NDArray[np.float64]) -> None:
        numbers = np.floor(times / BIN).astype(np.int64)
        edges = np.flatnonzero(np.diff(numbers)) + 1
        for part, number in zip(
            np.split(rates, edges),
            numbers[np.append(0, edges)] if len(numbers) else (),
            strict=False,
        ):
            if self._bin is not None and number != self._bin:
                self._close(self._bin)
            self._bin = int(number)
            self._rates.append(part)

    def _close(self, number: int) -> None:
        """Judge a bin that is complete."""
        median = float(np.median(np.concatenate(self._rates)))
        self._rates = []
        self._turned += BIN * median if median > _AT_REST else 0.0
        if self.first_turn is None and self._turned >= 2 * np.pi:
            self.first_turn = (number + 1) * BIN
        if median > SPINNING:
            self._moving.append(median)
        if len(self._moving) < _FEWEST:
            return
        usual = float(np.median(self._moving))
        self._turning |= median > TURNING * usual
        stands = bool(self._stalls) and self._stalls[-1].after is None
        if median >= STALLED * usual:
            if stands:
                self._stalls[-1].after = number
        elif self._turning and not stands:
            self._stalls.append(_Bins(number))
