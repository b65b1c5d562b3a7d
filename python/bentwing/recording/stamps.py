# SPDX-License-Identifier: MIT OR Apache-2.0
"""Decide message by message which stamp counts: header, recorder or the clock of them all."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from bentwing.base.errors import RecordingError
from bentwing.recording.clock_steps import MIN_STEP_NS, NS_PER_S
from bentwing.recording.clocks.steady import SteadyClock

if TYPE_CHECKING:
    from collections import Counter

    from bentwing.recording.clock_steps import ClockSteps

MAX_UNCONFIRMED_NS = NS_PER_S  # a larger step ahead of the recorder has to be confirmed
MAX_JUMPS = 50  # consecutive messages; more is a clock that was set, not a damaged stamp
AFTER_SEQUENCE = 4  # bytes, after which repeated messages are the same
MIN_GAP_NS = NS_PER_S // 2
GAP_PERIODS = 5


class Gap(NamedTuple):
    """Silence of a stream; absolute stamps in ns of the messages around it."""

    start_ns: int
    end_ns: int


class StampMonitor:
    """Stamps of one stream, put where its clock says and made increasing.

    A clock needs to know what comes later: call `foresee` with all messages before `accept`, or with
    none, then every stamp stands for itself.

    Parameters
    ----------
    topic : for messages
    use_recorder_time : the header stamps are all zero, so the recorder's clock has to do
    counts : receives `backwards_stamps`, `duplicate_stamps`, `stamp_jumps`
    offset_ns : added to every stamp, by the payload
    steps : finds where the clock was set; without, such a recording is refused
    """

    def __init__(
        self,
        topic: str,
        *,
        use_recorder_time: bool,
        counts: Counter[str],
        offset_ns: int = 0,
        steps: ClockSteps | None = None,
    ) -> None:
        self.gaps: list[Gap] = []
        self.first_backwards_ns: int | None = None
        self._topic, self._counts = topic, counts
        self._use_recorder_time, self._offset_ns = use_recorder_time, offset_ns
        self.steps = None if use_recorder_time else steps
        self._last_ns: int | None = None
        self._last_offset_ns = 0
        self._n_jumps = 0
        self._period_ns = 0.0
        self._suspect: tuple[int, int] | None = None
        self.clock = SteadyClock()
        self._foreseen_offset_ns: int | None = None
        self._newest = (0, b"")

    def foresee(
        self, header_ns: int, recorder_ns: int, raw: bytes, span: float | None = None
    ) -> int | None:
        """Take the stamps of a message that `accept` will be asked for later.

        Parameters
        ----------
        span : s, from the first to the last point of a sweep, where these have times of their own

        Returns
        -------
        int or None
            How many of the messages that wait for `accept` it comes before; None for a message to drop,
            which repeats the one before.
        """
        if self.steps is not None:
            self.steps.notice(header_ns + self._offset_ns, recorder_ns)
            if self.steps.is_suspect:
                return 0
        stamp_ns = self._raw_ns(header_ns, recorder_ns)
        # Two messages may well have one stamp, where stamps have a step and a late one held others up.
        before, self._newest = self._newest, (stamp_ns, raw[AFTER_SEQUENCE:])
        if before == self._newest:
            self._counts["duplicate_stamps"] += 1
            return None
        offset_ns = stamp_ns - recorder_ns
        before_ns, self._foreseen_offset_ns = self._foreseen_offset_ns, offset_ns
        if before_ns is not None and abs(offset_ns - before_ns) > MAX_UNCONFIRMED_NS:
            return 0
        return self.clock.foresee(stamp_ns, span)

    def accept(self, header_ns: int, recorder_ns: int) -> int | None:
        """Return the stamp to use in ns, or None for a message to drop."""
        stamp_ns = self.clock.steadied(self._raw_ns(header_ns, recorder_ns))
        offset_ns = stamp_ns - recorder_ns
        if self._last_ns is None:
            self._take(stamp_ns, offset_ns)
            return stamp_ns
        if abs(offset_ns - self._last_offset_ns) > MIN_STEP_NS:
            self._reject_jump(offset_ns)
            return None
        if self._is_unconfirmed(stamp_ns, offset_ns):
            self._counts["stamp_jumps"] += 1
            return None
        step_ns = stamp_ns - self._last_ns
        if step_ns <= 0:
            self._counts["duplicate_stamps" if step_ns == 0 else "backwards_stamps"] += 1
            if step_ns < 0 and self.first_backwards_ns is None:
                self.first_backwards_ns = stamp_ns
            return None
        self._note_gap(step_ns)
        self._take(stamp_ns, offset_ns)
        return stamp_ns

    def _raw_ns(self, header_ns: int, recorder_ns: int) -> int:
        shift_ns = 0 if self.steps is None else self.steps.shift_ns(recorder_ns)
        return (recorder_ns if self._use_recorder_time else header_ns) + self._offset_ns + shift_ns

    def _take(self, stamp_ns: int, offset_ns: int) -> None:
        self._last_ns, self._last_offset_ns, self._n_jumps = stamp_ns, offset_ns, 0
        self._suspect = None

    def _is_unconfirmed(self, stamp_ns: int, offset_ns: int) -> bool:
        """Whether a stamp runs ahead of the recorder's clock and no message before it did so too.

        Taking a single damaged stamp would make all the good ones after it go backwards.
        """
        if offset_ns - self._last_offset_ns <= MAX_UNCONFIRMED_NS:
            return False
        before, self._suspect = self._suspect, (stamp_ns, offset_ns)
        if before is None:
            return True
        return stamp_ns <= before[0] or abs(offset_ns - before[1]) > MAX_UNCONFIRMED_NS

    def _reject_jump(self, offset_ns: int) -> None:
        self._counts["stamp_jumps"] += 1
        self._n_jumps += 1
        if self._n_jumps > MAX_JUMPS:
            step = (offset_ns - self._last_offset_ns) / NS_PER_S
            msg = (
                f"{self._topic}: the header stamps step by {step:+.1f} s against the recorder's times and stay "
                "there, the clock was set during the recording; cut it there and map the parts one by one"
            )
            raise RecordingError(msg)

    def _note_gap(self, step_ns: int) -> None:
        limit_ns = max(MIN_GAP_NS, GAP_PERIODS * self._period_ns)
        if step_ns > limit_ns and self._period_ns and self._last_ns is not None:
            self.gaps.append(Gap(self._last_ns, self._last_ns + step_ns))
            return
        # A slow average, so that one late message does not hide the gap after it.
        self._period_ns = 0.9 * self._period_ns + 0.1 * step_ns if self._period_ns else step_ns
