# SPDX-License-Identifier: MIT OR Apache-2.0
"""The estimate of a run; where it contradicts the payload, the head is found and estimated anew."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bentwing import odometry
from bentwing.base.errors import EstimationError, RecordingError
from bentwing.evaluate.verdict import Evidence
from bentwing.run.beams import find_in_run, read_by
from bentwing.run.first_pass import FirstPass, blames_head

if TYPE_CHECKING:
    from bentwing.calibrate.set_up import SetUp
    from bentwing.evaluate.verdict import Verdict
    from bentwing.run.found import Found
    from bentwing.run.head import Head
    from bentwing.run.stages import Job


def estimate(job: Job, found: Found, head: Head) -> tuple[Job, Found]:
    """Estimate, and once more where the first estimate shows that the lidar's beams are off.

    Parameters, returns and errors are those of `_with_set_up`.
    """
    job, first = _with_set_up(job, found, head)
    beams = find_in_run(job, first)
    if beams is None:
        return job, first
    job.progress.note(beams.sentence())
    job = read_by(job, head, beams)
    before = replace(found, set_up=first.set_up, beams=beams)
    return job, _first_pass(job, before, may_stop=False)


def _with_set_up(job: Job, found: Found, head: Head) -> tuple[Job, Found]:
    """Estimate with the payload, and if that is contradicted with the set-up that the recording shows.

    Parameters
    ----------
    head : the recording, which may be read anew

    Returns
    -------
    The job, with the part of the recording that was used, and what was found.

    Raises
    ------
    RecordingError
        The estimate is wrong from the start, and no other set-up is certain.
    """
    may_repair = head.set_up is None and not (job.settings.trust_payload or job.settings.force)
    first = _first_pass(job, replace(found, set_up=head.set_up), may_stop=may_repair)
    if not may_repair or not _is_doubted(first):
        return job, first
    shown = head.found()
    if shown.doubt is not None:
        if first.doubt is not None:
            raise RecordingError(_refusal(first.doubt, shown))
        return job, _with_defect(first, shown)
    if shown.findings:
        head.use(shown)
        job = replace(job, part=head.part, settings=head.settings)
        job.folder.record.settings = head.settings.to_json()
    elif first.doubt is None:
        return job, first
    return job, _first_pass(job, replace(found, set_up=head.set_up), may_stop=False)


def _first_pass(job: Job, found: Found, *, may_stop: bool) -> Found:
    settings = job.settings
    engine = odometry.create(
        settings.estimator, settings.payload, settings.of_estimator, settings.threads
    )
    return FirstPass(job, engine, may_stop=may_stop).run(found)


def _is_doubted(first: Found) -> bool:
    """Whether another set-up of the head may explain why an estimate is not good."""
    if first.failure is not None:
        return isinstance(first.failure, EstimationError)
    return blames_head(first.doubt or first.verdict)


def _with_defect(first: Found, shown: SetUp) -> Found:
    """Return what was found with what the search for the set-up says is wrong, if it names it."""
    if shown.doubt is None or not shown.is_defect:
        return first
    evidence = Evidence("set_up", 1.0, (), {"problem": shown.doubt})
    return replace(first, evidence=(*first.evidence, evidence))


def _refusal(verdict: Verdict, shown: SetUp) -> str:
    main = verdict.reasons[0]
    return f"{shown.doubt} ({main.sentence}); to map it as payload.yaml says all the same, give --trust-payload"
