# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether an estimate that is under way is certainly wrong, judged now and then in its beginning."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.evaluate.verdict.judge import judge_so_far

if TYPE_CHECKING:
    from collections.abc import Callable

    from bentwing.evaluate.verdict.verdict import Verdict
    from bentwing.evaluate.verdict.watch import Watch
    from bentwing.odometry.interface import Snapshot
    from bentwing.recording.payload import Payload

# How often, s, at first and later, as all is judged again each time: it takes 6.5 s of motion, and is said within ten.
_INTERVAL, _SHARE, _LONGEST = 2.0, 0.2, 3.5
# s: later the set-up is known to be right, and what goes wrong is in the records of the windows.
_UNTIL = 60.0


class EarlyJudge:
    """Judges the beginning of an estimate, every two seconds at first.

    Parameters
    ----------
    payload : with which the estimate began
    watch : is given every batch that the estimator is fed
    """

    def __init__(self, payload: Payload, watch: Watch) -> None:
        self._payload, self._watch = payload, watch
        self._first: float | None = None
        self._judged = 0.0

    def is_young(self, newest: float) -> bool:
        """Whether an estimate of samples up to `newest`, s, is still judged."""
        return self._first is None or newest < self._first + _UNTIL

    def failure(self, newest: float, current: Callable[[], Snapshot | None]) -> Verdict | None:
        """Return the verdict on what is known now if it is that all is wrong.

        Parameters
        ----------
        newest : s, stamp of the newest sample
        current : returns what is known, which takes longer than most batches
        """
        if self._first is None:
            self._first = self._judged = newest
        interval = max(_INTERVAL, min(_LONGEST, _SHARE * (self._judged - self._first)))
        if newest < self._judged + interval or not self.is_young(newest):
            return None
        self._judged = newest
        now = current()
        estimate = None if now is None else now.estimate()
        verdict = judge_so_far(estimate, self._payload, self._watch)
        return verdict if verdict.state == "failed" else None
