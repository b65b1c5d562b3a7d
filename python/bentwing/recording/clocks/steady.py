# SPDX-License-Identifier: MIT OR Apache-2.0
"""Stamps of a stream put where its clock says, as far as it has one and needs it."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.clock import NS_PER_S
from bentwing.recording.clocks.findings import ClockFindings
from bentwing.recording.clocks.fit import fit_clock

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording.clocks.fit import ClockLine

BEHIND_NS = 30 * NS_PER_S
"""How long what was stamped before still tells of the clock; crystals change within minutes."""
MOST_BEHIND = 2000
"""Messages of it; more tell little more."""
MOST_BACK_NS = NS_PER_S // 20
"""By which a message that overtook others on its way goes back; more is a clock that was set."""
BLOCK_NS = NS_PER_S
"""Stamps that share a line."""
STAYS_BAD = 0.75
"""Of `GOOD`, once it was more."""
GOOD = 1.4e-4
"""s of jitter. Below it stamps are left as they are: they may be better than a line."""


class SteadyClock:
    """The clock of one stream.

    Call `foresee` with each stamp as early as it is known, and `steadied` with each one in turn.
    """

    def __init__(self) -> None:
        self.findings = ClockFindings()
        self._stamps_ns: list[int] = []
        self._spans: list[float] = []
        self._next = 0  # of the stamps, the first one that was not asked for
        self._steadied: deque[int] = deque()  # of the next ones, as far as they are known
        self._last_ns: int | None = None
        self._line: tuple[int, ClockLine] | None = None
        self._is_bad = False

    def foresee(self, stamp_ns: int, span: float | None = None) -> int:
        """Take the next stamp; the stream is not asked for it yet.

        Parameters
        ----------
        span : s, from the first to the last point of a sweep, where these have times of their own

        Returns
        -------
        int
            How many of the stamps that wait to be asked for it comes before.
        """
        place = max(self._next + len(self._steadied), bisect_right(self._stamps_ns, stamp_ns))
        back = len(self._stamps_ns) - place
        if back and self._stamps_ns[-1] - stamp_ns > MOST_BACK_NS:
            return 0
        self._stamps_ns.insert(place, stamp_ns)
        self._spans.insert(place, np.nan if span is None else span)
        return back

    def steadied(self, stamp_ns: int) -> int:
        """Return when the sensor's clock says that the message with this stamp was sent, ns.

        The stamp itself where the stream has no clock, where its stamps are good, and where it was not
        foreseen.
        """
        while self._next < len(self._stamps_ns) and self._stamps_ns[self._next] < stamp_ns:
            self._next += 1  # foreseen and never asked for
            if self._steadied:
                self._steadied.popleft()
        if self._next == len(self._stamps_ns) or self._stamps_ns[self._next] != stamp_ns:
            return stamp_ns
        if not self._steadied:
            self._steadied.extend(self._block())
        self._next += 1
        found_ns, before_ns = self._steadied.popleft(), self._last_ns
        if found_ns != stamp_ns and before_ns is not None and found_ns <= before_ns:
            found_ns = before_ns + 1
        self._last_ns = found_ns
        return found_ns

    def _block(self) -> list[int]:
        """Return the next stamps as they are steadied, at least one."""
        now_ns = self._stamps_ns[self._next]
        oldest = bisect_left(self._stamps_ns, now_ns - BEHIND_NS)
        forgotten = max(oldest, self._next - MOST_BEHIND)
        del self._stamps_ns[:forgotten], self._spans[:forgotten]
        low = self._next = self._next - forgotten
        # A stamp before those that were steadied already stands behind them, out of order.
        high = max(low + 1, bisect_left(self._stamps_ns, now_ns + BLOCK_NS))
        zero_ns = self._stamps_ns[0]
        stamps = (np.array(self._stamps_ns, dtype=np.int64) - zero_ns) / NS_PER_S
        line = fit_clock(stamps, low, high, self._known(zero_ns))
        if line is not None and _told_by_points(stamps, np.array(self._spans), line):
            line = None
        self._line = None if line is None else (zero_ns, line)
        # A stream that was seen to jitter does not become good by a lucky second.
        is_good = line is not None and line.jitter < (STAYS_BAD * GOOD if self._is_bad else GOOD)
        self._is_bad = line is not None and not is_good
        self.findings.add(stamps, low, high, line, corrected=self._is_bad)
        if line is None or is_good:
            return self._stamps_ns[low:high]
        times = line.times(line.numbers[low - line.first : high - line.first])
        found_ns: list[int] = (zero_ns + np.rint(times * NS_PER_S).astype(np.int64)).tolist()
        return found_ns

    def _known(self, zero_ns: int) -> ClockLine | None:
        """Return the line of the last block on another zero."""
        if self._line is None:
            return None
        before_ns, line = self._line
        shift = (zero_ns - before_ns) / NS_PER_S
        return replace(line, origin=line.origin - shift, punctual=line.punctual - shift)


def _told_by_points(
    stamps: NDArray[np.float64], spans: NDArray[np.float64], line: ClockLine
) -> bool:
    """Whether the times of the points know of the differences between the stamps.

    A driver that cuts sweeps between packets, or at an angle of a rotor, makes them last longer and
    shorter. Then the stamps are right, as irregular as they look.
    """
    part = slice(line.first, line.stop)
    steps = np.diff(stamps[part]) - line.period * np.diff(line.numbers)
    left = steps - spans[part][:-1]
    known = np.isfinite(left)
    if known.sum() < len(left) // 2 or len(left) < 2:
        return False
    return _spread(left[known]) < 0.5 * _spread(steps[known])


def _spread(values: NDArray[np.float64]) -> float:
    low, high = np.quantile(values, [0.1, 0.9])
    return float(high - low)
