# SPDX-License-Identifier: MIT OR Apache-2.0
"""The first pass over a recording: the estimate, and all that is learned while its samples go by."""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from bentwing.base.errors import EstimationError, NotEnoughDataError
from bentwing.calibrate.carrier import CarrierWatch, carrier_warnings
from bentwing.evaluate.verdict import EarlyJudge, Watch, judge_estimate
from bentwing.recording.losses import losses
from bentwing.run.found import Reading, Spin

if TYPE_CHECKING:
    from bentwing.base.estimate import Estimate
    from bentwing.evaluate.verdict import Verdict
    from bentwing.odometry.interface import Estimator
    from bentwing.recording import Batch
    from bentwing.run.found import Found
    from bentwing.run.stages import Job

# Reasons that another set-up of the head may explain, and those that no set-up does.
_OF_HEAD = frozenset(
    (
        "matches",
        "lost",
        "gravity",
        "gyro",
        "accelerometer",
        "calibration",
        "units",
        "speed",
        "slice",
    )
)
_OF_SAMPLES = frozenset(
    (
        "constant",
        "repeated",
        "gyro_limit",
        "accelerometer_limit",
        "even_ranges",
        "scatter",
        "point_order",
    )
)
# Plain where it comes first; no set-up makes up for samples that are not there.
_SPARSE = "imu_period"


def blames_head(verdict: Verdict) -> bool:
    """Whether another set-up of the head may explain why an estimate is not good."""
    kinds = {reason.kind for reason in verdict.reasons}
    failed = {reason.kind for reason in verdict.reasons if reason.state == "failed"}
    is_sparse = bool(verdict.reasons) and verdict.reasons[0].kind == _SPARSE
    return bool(kinds & _OF_HEAD) and not failed & _OF_SAMPLES and not is_sparse


class FirstPass:
    """Feeds an estimator, and watches what it is fed.

    Parameters
    ----------
    engine : that estimates
    may_stop : whether to stop as soon as the estimate is certainly wrong and the head may be to blame
    """

    def __init__(self, job: Job, engine: Estimator, *, may_stop: bool) -> None:
        self._job, self._engine, self._may_stop = job, engine, may_stop
        self._spin, self._watch = Spin(), Watch()
        self._carrier = CarrierWatch(job.part.payload)
        self._counts = Counter[str]()
        self._judge = EarlyJudge(job.part.payload, self._watch)

    def run(self, found: Found) -> Found:
        """Return what is known with the estimate; with a failure, as far as it goes."""
        failure: BaseException | None = None
        open_loop: Estimate | None = None
        doubt: Verdict | None = None
        job = self._job
        try:
            with (
                job.folder.stage("estimate"),
                job.progress.stage("estimate", job.part.length) as shown,
            ):
                for batch in job.part.batches(shown, self._counts):
                    self._take(batch)
                    if (doubt := self._doubt(batch)) is not None:
                        break
                open_loop = self._engine.result() if doubt is None else self._so_far()
        except BaseException as error:
            failure = error
            if isinstance(error, (EstimationError, KeyboardInterrupt)):
                open_loop = self._so_far(error)
            if isinstance(error, NotEnoughDataError):
                failure = self._with_losses(error)
        return self._with(replace(found, estimate=open_loop, doubt=doubt, failure=failure))

    def _take(self, batch: Batch) -> None:
        self._engine.feed(batch)
        self._spin.watch(batch)
        self._watch.add(batch)
        if not self._job.part.payload.self_hits:
            self._carrier.add(batch)

    def _doubt(self, batch: Batch) -> Verdict | None:
        """Return the verdict on the estimate so far if it is wrong and the head may be to blame."""
        if not self._may_stop or not len(batch.times):
            return None
        verdict = self._judge.failure(float(batch.times[-1]), lambda: self._engine.current)
        return verdict if verdict is not None and blames_head(verdict) else None

    def _so_far(self, error: BaseException | None = None) -> Estimate | None:
        # There may be nothing yet, and an interrupt may find a step half done.
        lacking = Exception if isinstance(error, KeyboardInterrupt) else EstimationError
        with suppress(lacking):
            return self._engine.so_far()
        return None

    def _with_losses(self, error: NotEnoughDataError) -> NotEnoughDataError:
        lost = losses(self._job.part.recording.counts + self._counts)
        return (
            NotEnoughDataError(f"{error}; of the recording, {', '.join(lost)}") if lost else error
        )

    def _with(self, found: Found) -> Found:
        part = self._job.part
        warnings = [
            *part.recording.warnings,
            *carrier_warnings(part.payload, self._carrier.boxes()),
        ]
        evidence = (
            ()
            if found.estimate is None
            else judge_estimate(found.estimate, part.payload, self._watch)
        )
        return replace(
            found,
            reading=Reading(
                dict(part.recording.counts + self._counts),
                warnings,
                {role: clock.to_json() for role, clock in part.recording.clocks.items()},
            ),
            spin=self._spin,
            evidence=tuple(evidence),
        )
