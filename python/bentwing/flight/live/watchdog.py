# SPDX-License-Identifier: MIT OR Apache-2.0
"""Ends an estimate that has failed, before anybody flies by it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.base.errors import DivergedError
from bentwing.evaluate.verdict import Watch, judge_so_far

if TYPE_CHECKING:
    from bentwing.odometry.interface import Snapshot
    from bentwing.recording.batches import Batch
    from bentwing.recording.payload import Payload

# How often an estimate is judged, s, and until when: later its set-up is known to be right, and what
# goes wrong is in the records of the windows.
_INTERVAL, _UNTIL = 2.0, 60.0


class Watchdog:
    """Judges the beginning of an estimate by the samples that it is fed.

    Parameters
    ----------
    payload : with which the estimate began
    """

    def __init__(self, payload: Payload) -> None:
        self._payload = payload
        self._watch = Watch()
        self._first: float | None = None
        self._newest = self._judged = -float("inf")

    def add(self, batch: Batch) -> None:
        """Take a batch that the estimator is fed."""
        if not len(batch.times):
            return
        self._first = float(batch.times[0]) if self._first is None else self._first
        self._newest = max(self._newest, float(batch.times[-1]))
        if self._is_young:
            self._watch.add(batch)

    def require_health(self, now: Snapshot | None) -> None:
        """Judge what is known by now, every two seconds.

        Raises
        ------
        DivergedError
            If the estimate is certainly wrong.
        """
        if self._newest < self._judged + _INTERVAL or not self._is_young:
            return
        self._judged = self._newest
        estimate = None if now is None else now.estimate()
        verdict = judge_so_far(estimate, self._payload, self._watch)
        if verdict.state == "failed":
            main = verdict.reasons[0]
            msg = f"the estimate is wrong: {main.sentence}; {main.advice}"
            raise DivergedError(msg)

    @property
    def _is_young(self) -> bool:
        return self._first is not None and self._newest < self._first + _UNTIL
