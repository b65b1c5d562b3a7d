# SPDX-License-Identifier: MIT OR Apache-2.0
"""A motor turns smoothly: angles in coarse steps, or with stamps that jitter, are smoothed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.batches import EncoderBatch

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

COARSE = 3e-4
"""rad of noise from which on angles are smoothed: 3 mm at 10 m. Finer ones stay as they are."""
REACH = 0.02
"""s before and behind an angle, within which the motor turns with a constant acceleration."""
MOST_HALF, FEWEST_HALF = 25, 2
"""Angles on each side."""
ENOUGH = 64
"""Angles that tell the noise."""
ROUGH = 3.0
"""Times the noise that a stretch may be off; with more the motor is not smooth there."""


class SmoothAngles:
    """Angles of one encoder, as they come."""

    def __init__(self) -> None:
        self._noise = 0.0
        self._half = 0
        self._times = np.zeros(0)
        self._angles = np.zeros(0)
        self._n_given = 0  # of those that are kept
        self._n_seen = 0

    def add(self, batch: EncoderBatch) -> EncoderBatch | None:
        """Take the next angles; return those that need not wait for others.

        The noise is measured after every `ENOUGH` angles, in whatever pieces they come.
        """
        parts: list[EncoderBatch] = []
        first = 0
        while first < len(batch.times):
            last = min(first + ENOUGH - self._n_seen % ENOUGH, len(batch.times))
            part = EncoderBatch(batch.times[first:last], batch.angles[first:last])
            if (given := self._take(part)) is not None:
                parts.append(given)
            first = last
        if len(parts) < 2:
            return parts[0] if parts else None
        return EncoderBatch(
            np.concatenate([part.times for part in parts]),
            np.concatenate([part.angles for part in parts]),
        )

    def _take(self, part: EncoderBatch) -> EncoderBatch | None:
        self._times = np.concatenate([self._times, part.times])
        self._angles = np.concatenate([self._angles, part.angles])
        self._n_seen += len(part.times)
        given: EncoderBatch | None = part
        if self._noise == 0.0:
            self._n_given = len(self._times)
        else:
            given = self._smoothed(len(self._times) - self._half)
        if self._n_seen % ENOUGH == 0:
            self._measure()
        self._forget()
        return given

    def finish(self) -> EncoderBatch | None:
        """Return what still waits."""
        return self._smoothed(len(self._times))

    def _measure(self) -> None:
        """Measure the noise: fourth differences know nothing of a smooth motion, and 70 times its variance."""
        times, angles = self._times[-ENOUGH:], self._angles[-ENOUGH:]
        step = float(np.median(np.diff(times)))
        half = min(MOST_HALF, int(REACH / step)) if step > 0 else 0
        left = np.diff(angles, 4)
        noise = 1.4826 * float(np.median(np.abs(left))) / np.sqrt(70.0)
        if half >= FEWEST_HALF and noise > COARSE:
            self._noise, self._half = max(noise, self._noise), half

    def _smoothed(self, stop: int) -> EncoderBatch | None:
        first, self._n_given = self._n_given, max(self._n_given, stop)
        if stop <= first:
            return None
        times, angles = self._times[first:stop], self._angles[first:stop].copy()
        low, high = max(first, self._half), min(stop, len(self._times) - self._half)
        if self._noise and low < high:
            angles[low - first : high - first] = self._parabolas(low, high)
        return EncoderBatch(times, angles)

    def _parabolas(self, low: int, high: int) -> Array:
        """Fit a parabola around each of angles [low, high), and take its middle."""
        width = 2 * self._half + 1
        part = slice(low - self._half, high + self._half)
        windows = np.lib.stride_tricks.sliding_window_view
        t = windows(self._times[part], width) - self._times[low:high, None]
        y = windows(self._angles[part], width) - self._angles[low:high, None]
        powers = t[:, :, None] ** np.arange(3) / REACH ** np.arange(3)
        fits = np.linalg.solve(
            np.einsum("nki,nkj->nij", powers, powers), np.einsum("nki,nk->ni", powers, y)[..., None]
        )[..., 0]
        left = y - np.einsum("nki,ni->nk", powers, fits)
        is_smooth = np.sqrt(np.mean(left**2, axis=1)) < ROUGH * self._noise
        is_smooth &= np.abs(t).max(axis=1) < 2 * REACH
        return np.asarray(self._angles[low:high] + np.where(is_smooth, fits[:, 0], 0.0))

    def _forget(self) -> None:
        """Keep what tells the noise, and what the next angles need."""
        n = min(len(self._times) - 2 * ENOUGH, self._n_given - self._half)
        if n > 0:
            self._times, self._angles = self._times[n:], self._angles[n:]
            self._n_given -= n
