# SPDX-License-Identifier: MIT OR Apache-2.0
"""Ends an estimate that has failed, before anybody flies by it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import DivergedError
from bentwing.evaluate.verdict import EarlyJudge, Watch

if TYPE_CHECKING:
    from collections.abc import Callable

    from bentwing.odometry.interface import Snapshot
    from bentwing.recording.batches import Batch
    from bentwing.recording.payload import Payload


class Watchdog:
    """Judges the beginning of an estimate by the samples that it is fed.

    Parameters
    ----------
    payload : with which the estimate began
    """

    def __init__(self, payload: Payload) -> None:
        self._watch = Watch()
        self._judge = EarlyJudge(payload, self._watch)
        self._newest = -float("inf")

    def add(self, batch: Batch) -> None:
        """Take a batch that the estimator is fed."""
        if not len(batch.times):
            return
        self._newest = max(self._newest, float(batch.times[-1]))
        if self._judge.is_young(self._newest):
            self._watch.add(batch)

    def require_health(self, current: Callable[[], Snapshot | None]) -> None:
        """Judge what is known by now, every two seconds.

        Parameters
        ----------
        current : as of `EarlyJudge.failure`

        Raises
        ------
        DivergedError
            If the estimate is certainly wrong.
        """
        if not np.isfinite(self._newest):
            return
        verdict = self._judge.failure(self._newest, current)
        if verdict is not None:
            main = verdict.reasons[0]
            msg = f"the estimate is wrong: {main.sentence}; {main.advice}"
            raise DivergedError(msg)
