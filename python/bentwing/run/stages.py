# SPDX-License-Identifier: MIT OR Apache-2.0
"""The stages of a run: each takes what was found so far and returns it with one thing more.

A stage imports what it alone uses, so that a run begins before its last stage is loaded.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from bentwing.base.errors import NotEnoughDataError
from bentwing.base.progress import Progress
from bentwing.evaluate.verdict import judge_closing, judge_marks, judge_revisits
from bentwing.run.gnss import NO_LEVER, receivers_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bentwing.base.estimate import Estimate
    from bentwing.base.progress import Stage
    from bentwing.closing.localize import Difference, PriorMap
    from bentwing.map.chunk import MapChunk
    from bentwing.recording.preprocess import RecordingPart
    from bentwing.run.folder import RunFolder
    from bentwing.run.found import Found
    from bentwing.run.settings import RunSettings


@dataclass(frozen=True, slots=True)
class Job:
    """What the stages of a run work with.

    Attributes
    ----------
    part : of the recording
    folder : times the stages and has room for their files
    prior : the map in which the recording is localized, if there is one
    """

    part: RecordingPart
    folder: RunFolder
    settings: RunSettings
    progress: Progress
    prior: PriorMap | None = None

    @property
    def origin_ns(self) -> int:
        """Absolute time of the recording's start, ns UTC."""
        return self.part.recording.clock.start_ns


def close(job: Job, found: Found) -> Found:
    """Correct the trajectory by all that was seen more than once, or that a prior map shows."""
    from bentwing.closing.global_registration import Budget, close_loops

    open_loop, part, threads = _known(found), job.part, job.settings.threads
    closing = job.settings.closing
    budget = Budget.of(part.length, closing)
    job.progress.note(f"loops: {budget.sentence()}")
    if job.prior is not None:
        found = _localize(job, found, job.prior)
        if found.failure is not None:
            return found
        open_loop = _known(found)
    with job.folder.stage("loops"), job.progress.stage("loops", part.length) as shown:
        batches = part.batches(shown, Counter())  # the first pass has counted what is dropped
        is_cut = len(open_loop.segments) > 1
        if (is_cut or job.settings.loops) and job.prior is None:
            from bentwing.closing.joining.segments import close_segments

            closed, merging = close_segments(
                open_loop,
                batches,
                part.payload,
                settings=closing,
                budget=budget,
                loops=job.settings.loops,
                threads=threads,
            )
            found = replace(found, merging=merging if is_cut else None)
        else:
            near = None if job.prior is None else job.prior.surfels_near(open_loop.trajectory)
            closed = close_loops(
                open_loop,
                batches,
                part.payload,
                settings=closing,
                budget=budget,
                known=near,
                threads=threads,
            )
    return replace(
        found,
        estimate=closed.estimate,
        loop_closure=closed.record,
        stage_warnings=(*found.stage_warnings, *closed.warnings),
        evidence=(*found.evidence, *judge_closing(closed.record, [open_loop])),
    )


def _localize(job: Job, found: Found, prior: PriorMap) -> Found:
    from bentwing.closing.localize import NotInMapError, find_in_map

    part = job.part
    try:
        with job.folder.stage("localize"), job.progress.stage("localize", part.length) as shown:
            batches = part.batches(shown, Counter())
            there = find_in_map(_known(found), batches, prior, threads=job.settings.threads)
    except NotInMapError as error:
        return replace(found, localization=error.record, failure=error)
    return replace(found, estimate=there.estimate, localization=there.record)


def place_on_earth(job: Job, found: Found) -> Found:
    """Find where on the Earth the map is; without that it stays in its own frame."""
    estimate, part, settings = _known(found), job.part, job.settings.georeferencing
    if job.prior is not None:
        return replace(found, placed=job.prior.coordinates)
    named = (part.payload.gnss, settings.fixes, settings.control_points)
    if all(one is None for one in named):
        return found
    from bentwing.closing.georeference.georeference import georeference

    with job.folder.stage("georeference"), Progress().stage("", part.length) as unseen:
        try:
            placed = georeference(
                estimate.trajectory,
                receivers_of(part, settings),
                settings,
                segments=estimate.segments,
                reach=part.payload.lidar.max_range,
                chunks=lambda: _chunks(job, estimate, unseen, {}),
            )
        except NotEnoughDataError as error:
            note = f"{error}; the map stays in its own frame"
            return replace(found, stage_warnings=(*found.stage_warnings, note))
    if placed is None:
        return found
    if placed.trajectory is not estimate.trajectory:
        # Bent by fixes, it is no longer what the covariances are of.
        estimate = replace(
            estimate, trajectory=placed.trajectory, covariances=None, short_variances=None
        )
    lacking = (NO_LEVER,) if part.payload.gnss is None and settings.fixes is not None else ()
    warnings = (*found.stage_warnings, *lacking, *placed.warnings)
    evidence = (*found.evidence, *judge_marks(placed.record))
    return replace(
        found, estimate=estimate, placed=placed, stage_warnings=warnings, evidence=evidence
    )


def make_map(job: Job, found: Found) -> Found:
    """Write the map, and what has changed since the prior map."""
    from bentwing.evaluate.expected import expected_accuracy
    from bentwing.run.mapping import MapSource, write_map

    estimate, part = _known(found), job.part
    with job.folder.stage("map"), job.progress.stage("map", part.length) as shown:
        written = write_map(
            job.folder,
            [
                MapSource(
                    estimate, job.origin_ns, lambda counts: _chunks(job, estimate, shown, counts)
                )
            ],
            job.settings,
            duration=part.length,
            placed=found.placed,
            difference=_difference(job, estimate),
        )
    sigma = part.payload.lidar.range_sigma
    evidence = judge_revisits(written.revisits, sigma)
    accuracy = expected_accuracy(estimate, sigma, written.revisits)
    return replace(found, map=written, accuracy=accuracy, evidence=(*found.evidence, *evidence))


def leave_without_map(job: Job, found: Found) -> Found:
    """Say how accurate the trajectory is expected to be, where no map is asked for."""
    from bentwing.evaluate.expected import expected_accuracy

    accuracy = expected_accuracy(_known(found), job.part.payload.lidar.range_sigma)
    if accuracy is not None:
        accuracy = replace(accuracy, map_thickness=None)
    return replace(found, accuracy=accuracy)


def _difference(job: Job, estimate: Estimate) -> Difference | None:
    if job.prior is None:
        return None
    from bentwing.closing.localize import Difference

    return Difference(job.prior.cloud, estimate.trajectory)


def _known(found: Found) -> Estimate:
    if found.estimate is None:
        msg = "found.estimate: expected the estimate of an earlier stage, got None"
        raise ValueError(msg)
    return found.estimate


def _chunks(
    job: Job, estimate: Estimate, shown: Stage, counts: dict[str, int]
) -> Iterator[MapChunk]:
    from bentwing.map.project import project

    return project(
        job.part.batches(shown, Counter()),  # the first pass has counted what is dropped
        estimate.trajectory,
        estimate.calibration,
        segments=estimate.segments,
        threads=job.settings.threads,
        counts=counts,
    )
