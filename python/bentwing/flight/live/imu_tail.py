# SPDX-License-Identifier: MIT OR Apache-2.0
"""The inertial samples since the last registered window."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.batches import ImuBatch

if TYPE_CHECKING:
    from numpy.typing import NDArray


class ImuTail:
    """Appended at the end, forgotten at the beginning; both at constant cost per sample."""

    def __init__(self) -> None:
        self._rows = np.empty((1024, 7))
        self._first = 0
        self._last = 0

    def __len__(self) -> int:
        return self._last - self._first

    @property
    def end(self) -> float:
        """Time of the newest sample, s; minus infinity without any."""
        return float(self._rows[self._last - 1, 0]) if len(self) else -np.inf

    def append(self, batch: ImuBatch) -> None:
        """Take the next samples."""
        n = len(batch.times)
        if self._last + n > len(self._rows):
            self._make_room(n)
        rows = self._rows[self._last : self._last + n]
        rows[:, 0], rows[:, 1:4], rows[:, 4:7] = batch.times, batch.gyro, batch.accel
        self._last += n

    def forget(self, before: float) -> None:
        """Drop what is older than a time, s."""
        self._first += int(np.searchsorted(self._held[:, 0], before))

    def since(self, time: float) -> ImuBatch:
        """Return copies of the samples from a time on, s."""
        rows = self._held[int(np.searchsorted(self._held[:, 0], time)) :]
        return ImuBatch(rows[:, 0].copy(), rows[:, 1:4].copy(), rows[:, 4:7].copy())

    @property
    def _held(self) -> NDArray[np.float64]:
        return self._rows[self._first : self._last]

    def _make_room(self, n: int) -> None:
        held = self._held
        rows = np.empty((2 * max(len(held) + n, 512), 7))
        rows[: len(held)] = held
        self._rows, self._first, self._last = rows, 0, len(held)
