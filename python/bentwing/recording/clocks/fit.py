# SPDX-License-Identifier: MIT OR Apache-2.0
"""The line through the stamps of a periodic sensor, over the longest stretch that has one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.clocks.counting import counts, usual_period

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

FEWEST = 64
"""Messages of a line; a phase that walks may look like jitter in fewer."""
SEED = 32
"""Messages from which a line grows."""
SHORTEST = 2.0
"""s, of a line."""
LATE = 4.0
"""Times the jitter beyond the line: late, and no part of it."""
MOST_LATE = 0.25
"""Share of the messages."""
MOST_EARLY = 0.01
"""Share of the messages that may be as early as others are late: nothing arrives before it is sent."""
MOST_SKIPS, MOST_UNCLEAR_SKIPS, CLEAR = 0.3, 0.03, 0.1
"""Share of the steps in which something was lost. With jitter beyond a share `CLEAR` of the period it has
to be the lower one: periods can be put into any stamps if enough is taken for lost."""
N_PARTS = 64
"""Of a stretch, that have to agree on the line; fewer of a short one, each of `PART` messages."""
PART = 16
DISAGREEMENT = 4.5, 0.1
"""How far a part may be off: deviations of its mean, and shares of the jitter."""
MOST_LASTING = 0.4
"""Correlation of neighbours. Where more lasts, the sensor itself is fast and slow: a rotor, say."""
EARLY = 3.0
"""Times the jitter that a message may be earlier than the punctual ones."""
STARTS = 0, -1, 1, -2, 2
"""From where lines grow, in `SEED` messages: what is late or lost there may mislead one of them."""
WIDE = 256
"""Messages on both sides that tell the usual period."""
N_ROUNDS = 6
"""Of the robust fit."""


@dataclass(frozen=True, slots=True)
class ClockLine:
    """Stamps of a stretch as one clock: number n is sent at `origin + period * n`.

    The origin includes the usual delay, as no stamp is without it.

    Attributes
    ----------
    origin, period : s
    jitter : s, standard deviation of the stamps that are not late
    punctual : s, the origin of messages that come as early as a few do
    first : of the stretch's messages among those that were given
    numbers : (M,) of its messages
    """

    origin: float
    period: float
    jitter: float
    punctual: float
    first: int
    numbers: NDArray[np.int64]

    @property
    def stop(self) -> int:
        """The message after the stretch."""
        return self.first + len(self.numbers)

    def time(self, number: int) -> float:
        """Return when a message is sent, s."""
        return self.origin + self.period * number

    def times(self, numbers: NDArray[np.int64]) -> Array:
        """Return when messages (K,) are sent, s."""
        return np.asarray(self.origin + self.period * numbers)

    def is_steady(self, stamps: Array) -> bool:
        """Whether what is left of the stamps (N,), s, is jitter and lateness, without rule in time."""
        most = MOST_SKIPS if self.jitter < CLEAR * self.period else MOST_UNCLEAR_SKIPS
        if len(self.numbers) < FEWEST or (np.diff(self.numbers) > 1).mean() > most:
            return False
        residuals = stamps[self.first : self.stop] - self.times(self.numbers)
        return _is_steady(residuals, self.jitter)


def fit_clock(
    stamps: Array, low: int, high: int, known: ClockLine | None = None
) -> ClockLine | None:
    """Return the line of the longest stretch around messages [low, high) that has one.

    It grows on both sides as long as it stays a line: a step of the clock, another rate or a stretch
    without rule ends it. None where not even the shortest stretch is one, or where jitter is as large
    as the period and nothing can be counted.

    Parameters
    ----------
    stamps : (N,) s, non-decreasing, near zero
    low, high : which messages the line has to contain
    known : the line of a stretch that overlaps, on the same zero
    """
    if len(stamps) < FEWEST:
        return None
    if known is not None:
        line = _refined(stamps, 0, len(stamps), known)
        if line is not None and line.is_steady(stamps):
            return line
    found = [_grown(stamps, low, high, shift * SEED) for shift in STARTS]
    return min((line for line in found if line), key=lambda line: line.jitter, default=None)


def _grown(stamps: Array, low: int, high: int, shift: int) -> ClockLine | None:
    """Return the line that grows from a few messages near the middle of [low, high), if one does."""
    middle, half = (low + high) // 2 + shift, SEED // 2
    guess = _first_guess(stamps, middle - half, middle + half)
    found: ClockLine | None = None
    while guess is not None:
        begin = max(0, min(middle - half, len(stamps) - 2 * half))
        end = min(len(stamps), begin + 2 * half)
        guess = _refined(stamps, begin, end, guess)
        if begin <= low and end >= high and stamps[end - 1] - stamps[begin] >= SHORTEST:
            if guess is None or not guess.is_steady(stamps):
                break
            found = guess
        if begin == 0 and end == len(stamps):
            break
        half *= 2
    return found


def _first_guess(stamps: Array, begin: int, end: int) -> ClockLine | None:
    """Return the line of a few messages, of which hardly any is lost."""
    begin = max(0, min(begin, len(stamps) - SEED))
    around = stamps[max(0, begin - WIDE) : end + WIDE]
    period = usual_period(around)
    if not period > 0:
        return None
    part = stamps[begin : begin + SEED]
    order = np.arange(len(part))
    phases = part - period * order
    punctual = float(np.min(phases[: len(part) // 2]))
    return ClockLine(punctual, period, period, punctual, begin, order)


def _refined(stamps: Array, begin: int, end: int, guess: ClockLine) -> ClockLine | None:
    """Return the line of a stretch by one that is nearly it; None where nothing can be counted."""
    part = stamps[begin:end]
    line, before = guess, None
    for _ in range(N_ROUNDS):
        numbers = counts(part, line.punctual, line.period, EARLY * line.jitter)
        if before is not None and (numbers == before).all():
            break
        fitted = _fitted(part, numbers)
        if fitted is None:
            return None
        origin, period, jitter, residuals = fitted
        if not (period > 0.0 and jitter <= period):
            return None
        punctual = origin + float(np.quantile(residuals, 0.05))
        line, before = ClockLine(origin, period, jitter, punctual, begin, numbers), numbers
    return line


def _fitted(stamps: Array, numbers: NDArray[np.int64]) -> tuple[float, float, float, Array] | None:
    """Return origin, period, jitter and residuals of a robust fit."""
    n = numbers.astype(np.float64)
    usual = np.ones(len(stamps), dtype=bool)
    for _ in range(N_ROUNDS):
        centre, mean = n[usual].mean(), stamps[usual].mean()
        away = n[usual] - centre
        spread = float(away @ away)
        if spread == 0.0:
            return None
        period = float(away @ (stamps[usual] - mean)) / spread
        residuals = stamps - mean - period * (n - centre)
        middle = np.median(residuals)
        deviation = 1.4826 * float(np.median(np.abs(residuals - middle)))
        before, usual = usual, np.abs(residuals - middle) <= LATE * max(deviation, 1e-9)
        if (usual == before).all():
            break
    shift = float(residuals[usual].mean())
    residuals = residuals - shift
    jitter = float(np.sqrt(np.mean(residuals[usual] ** 2)))
    return float(mean - period * centre + shift), period, jitter, residuals


def _is_steady(residuals: Array, jitter: float) -> bool:
    """Whether what is left of the stamps is jitter and lateness, without rule in time."""
    limit = LATE * max(jitter, 1e-9)
    late, early = residuals > limit, residuals < -limit
    n = len(residuals)
    if late.sum() > MOST_LATE * n or early.sum() > max(1.0, MOST_EARLY * n):
        return False
    usual = ~(late | early)
    n_parts = min(N_PARTS, n // PART)
    size, n_larger = divmod(n, n_parts)
    begins = size * np.arange(n_parts) + np.minimum(np.arange(n_parts), n_larger)
    left = np.where(usual, residuals, 0.0)
    n_kept = np.add.reduceat(usual, begins, dtype=np.int64)
    if not n_kept.all():
        return False
    means = np.add.reduceat(left, begins) / n_kept
    allowed = jitter * (DISAGREEMENT[0] / np.sqrt(n_kept) + DISAGREEMENT[1])
    if (np.abs(means) > np.maximum(allowed, 1e-9)).any():
        return False
    return float(left[1:] @ left[:-1]) <= MOST_LASTING * max(float(left @ left), 1e-18 * n)
