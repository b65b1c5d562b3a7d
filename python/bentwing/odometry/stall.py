# SPDX-License-Identifier: MIT OR Apache-2.0
"""When a turning head counts as stalled, and the watch that tells the pilot while it flies."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

BIN = 0.25
"""s; the median within is free of vibration, and a stall shorter than this is harmless."""
STALLED = 0.25
"""Share of the usual rate below which a head is stalled."""
TURNING = 0.5
"""Share of the usual rate above which it is surely turning."""
MIN_STALL = 0.5
"""s, shorter ones leave no trace in a map."""
LOST_AFTER = 2.0
"""s; of a longer stall registration may not recover (Kaul 2015, section 3.2)."""


@dataclass(frozen=True, slots=True)
class Stall:
    """A stall that lasts: since when, and for how long by now, s."""

    start: float
    length: float

    @property
    def warning(self) -> str:
        """What to tell the pilot, within the 50 characters of a MAVLink text."""
        if self.length < LOST_AFTER:
            return f"head stalled {self.length:.1f} s: add thrust"
        return f"head stalled {self.length:.1f} s: land or map is cut"


class StallWatch:
    """Finds stalls while the samples come, by the same definition as `bentwing info` afterwards.

    Before the first turn a head at rest is not stalled: it stands on the ground.

    Parameters
    ----------
    usual_rate : rad/s, the rate that is held or commanded
    """

    def __init__(self, usual_rate: float) -> None:
        if not (np.isfinite(usual_rate) and usual_rate > 0):
            msg = f"usual_rate: expected a rate above zero, got {usual_rate} rad/s"
            raise UsageError(msg)
        self._usual = usual_rate
        self._recent: deque[tuple[float, float]] = deque()
        self._angle: tuple[float, float] | None = None
        self._was_turning = False
        self._slow_since: float | None = None
        self.n_refused = 0

    def add_gyro(self, times: ArrayLike, gyro: ArrayLike) -> Stall | None:
        """Take gyro samples (M, 3), rad/s, at times (M,), s, of an IMU that turns with the head."""
        table = np.atleast_2d(np.asarray(gyro, np.float64))
        return self._add(
            np.atleast_1d(np.asarray(times, np.float64)), np.linalg.norm(table, axis=1)
        )

    def add_encoder(self, times: ArrayLike, angles: ArrayLike) -> Stall | None:
        """Take unwrapped angles (K,), rad, of a motor at times (K,), s."""
        stamps = np.atleast_1d(np.asarray(times, np.float64))
        values = np.atleast_1d(np.asarray(angles, np.float64))
        if self._angle is not None:
            stamps = np.concatenate([[self._angle[0]], stamps])
            values = np.concatenate([[self._angle[1]], values])
        good = np.isfinite(stamps) & np.isfinite(values)
        self.n_refused += int((~good).sum())
        stamps, values = stamps[good], values[good]
        if len(stamps):
            self._angle = float(stamps[-1]), float(values[-1])
        rates = np.abs(np.diff(values)) / np.maximum(np.diff(stamps), 1e-9)
        return self._add(stamps[1:], rates)

    @property
    def stall(self) -> Stall | None:
        """The stall that lasts, if there is one."""
        if self._slow_since is None or not self._recent:
            return None
        length = self._recent[-1][0] - self._slow_since
        return Stall(self._slow_since, length) if length >= MIN_STALL else None

    def _add(self, times: NDArray[np.float64], rates: NDArray[np.float64]) -> Stall | None:
        if times.shape != rates.shape:
            msg = f"times and rates: expected equal lengths, got {times.shape} and {rates.shape}"
            raise ValueError(msg)
        for time, rate in zip(times.tolist(), rates.tolist(), strict=True):
            self._take(time, rate)
        return self.stall

    def _take(self, time: float, rate: float) -> None:
        newest = self._recent[-1][0] if self._recent else -np.inf
        if not (np.isfinite(time) and np.isfinite(rate) and time >= newest):
            self.n_refused += 1
            return
        self._recent.append((time, rate))
        while self._recent[0][0] < time - BIN:
            self._recent.popleft()
        median = float(np.median([rate for _, rate in self._recent]))
        self._was_turning |= median > TURNING * self._usual
        if not self._was_turning or median >= STALLED * self._usual:
            self._slow_since = None
        elif self._slow_since is None:
            self._slow_since = time - BIN / 2  # the median follows half a window later
