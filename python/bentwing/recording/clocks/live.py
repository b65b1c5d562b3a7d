# SPDX-License-Identifier: MIT OR Apache-2.0
"""The clock of a stream while it comes: what later stamps will say is not known yet."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.clocks.fit import EARLY, LATE, ClockLine, fit_clock
from bentwing.recording.clocks.steady import GOOD, MOST_BEHIND

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

EVERY = 0.5
"""s, after which the line is fitted anew."""
SPARSE = 0.125
"""Of the period. With less jitter one stamp tells how many periods have passed."""
AGREEING = 8
"""Stamps that have to agree that something was lost, where one alone does not tell."""


class LiveClock:
    """The clock of one stream, by the stamps so far."""

    def __init__(self) -> None:
        self._stamps: deque[float] = deque(maxlen=MOST_BEHIND)
        self._line: ClockLine | None = None
        self._fitted = -np.inf
        # What each of the last messages says of the number of the newest one.
        self._said: deque[int] = deque(maxlen=AGREEING)
        self._newest = -np.inf

    def steadied(self, stamps: Array) -> Array:
        """Return stamps (N,), s, not before those of earlier calls, where the clock says they belong."""
        return np.array([self._one(stamp) for stamp in stamps.tolist()], dtype=np.float64)

    def _one(self, stamp: float) -> float:
        self._stamps.append(stamp)
        placed = stamp if self._line is None else self._placed(stamp, self._line)
        if stamp >= self._fitted + EVERY:
            self._fit()
        self._newest = max(placed, self._newest)
        return self._newest

    def _fit(self) -> None:
        stamps = np.array(self._stamps)
        self._fitted = float(stamps[-1])
        low = int(np.searchsorted(stamps, stamps[-1] - EVERY))
        line = fit_clock(stamps, low, len(stamps), self._line)
        self._line = line if line is not None and line.jitter >= GOOD else None
        self._said.clear()
        if self._line is not None:
            for stamp in stamps[-AGREEING:]:
                self._placed(stamp, self._line)

    def _placed(self, stamp: float, line: ClockLine) -> float:
        """Return where a stamp belongs.

        A late stamp looks as if something had been lost before it. With little jitter it is lost only
        if the stamp fits what comes then; with much all of the last stamps have to agree.
        """
        margin = min(EARLY * line.jitter, 0.5 * line.period)
        said = int(np.floor((stamp - line.punctual + margin) / line.period))
        next_number = min(self._said) + 1 if self._said else said
        if said - next_number >= AGREEING:  # a gap
            self._said.clear()
        is_punctual = stamp - line.time(said) <= LATE * line.jitter
        if line.jitter <= SPARSE * line.period:
            self._said.clear()
            number = said if is_punctual else min(said, next_number)
            self._said.append(number)
            return line.time(number)
        self._said = deque((n + 1 for n in self._said), maxlen=AGREEING)
        self._said.append(said)
        return line.time(min(self._said))
