# SPDX-License-Identifier: MIT OR Apache-2.0
"""The stages of a run: each takes what the run has found so far and adds to it."""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import EstimationError, NotEnoughDataError
from bentwing.base.progress import Progress
from bentwing.closing.georeference import Georeferenced, GeoreferenceSettings, georeference
from bentwing.closing.global_registration import Budget, GlobalSettings, close_loops
from bentwing.closing.joining.segments import close_segments
from bentwing.closing.localize import Difference, NotInMapError, find_in_map
from bentwing.map.chunk import untimed
from bentwing.map.clean import CleanSettings, clean
from bentwing.map.project import project
from bentwing.map.thin import thin
from bentwing.map.writer import open_map

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bentwing.base.estimate import Estimate
    from bentwing.base.progress import Stage
    from bentwing.closing.global_registration import Closed
    from bentwing.closing.localize import GivenCoordinates, PriorMap
    from bentwing.map.chunk import MapChunk
    from bentwing.odometry.interface import Estimator
    from bentwing.recording.preprocess import RecordingPart
    from bentwing.run.folder import RunFolder
    from bentwing.run.run import Run

    Placed = Georeferenced | GivenCoordinates


@dataclass(frozen=True, slots=True)
class Job:
    """A run and what its stages work with.

    Attributes
    ----------
    run : what was found so far
    asked : the settings as run.json has them
    prior : the map it is found in, if there is one
    """

    run: Run
    part: RecordingPart
    folder: RunFolder
    watch: Progress
    asked: dict[str, Any]
    prior: PriorMap | None = None

    @property
    def origin_ns(self) -> int:
        """Absolute time of the recording's start, ns UTC."""
        return self.part.recording.clock.start_ns

    def write_trajectory(self, name: str, estimate: Estimate) -> None:
        """Write trajectory.txt or odometry.txt."""
        self.folder.write_trajectory(name, estimate, self.origin_ns)


def estimate(job: Job, engine: Estimator) -> None:
    """Find the open-loop trajectory and the calibration."""
    run, part, folder, counts = job.run, job.part, job.folder, Counter[str]()
    with folder.stage("estimate"), job.watch.stage("estimate", part.length) as shown:
        try:
            for batch in part.batches(shown, counts):
                engine.feed(batch)
                run.watch(batch)
            run.estimate = engine.result()
        except (EstimationError, KeyboardInterrupt):
            with suppress(EstimationError):  # there may be nothing yet
                run.estimate = engine.so_far()
            raise
        finally:
            # also of a failure: the trajectory up to there shows where it went wrong
            folder.record["counts"].update(part.recording.counts + counts)
            folder.record["warnings"] += part.recording.warnings
            if run.estimate is not None:
                folder.add_estimate(run.estimate)
                job.write_trajectory("odometry.txt", run.estimate)
        job.write_trajectory("trajectory.txt", run.estimate)


def register(job: Job) -> None:
    """Correct the trajectory by all that was seen more than once, or that a map shows already."""
    found, folder, part = job.run.estimate, job.folder, job.part
    if found is None:
        return
    budget = Budget.of(part.length, GlobalSettings())
    job.watch.note(f"loops: {budget.sentence()}")
    if job.prior is not None:
        found = _localized(job, found, job.prior)
    with folder.stage("loops"), job.watch.stage("loops", part.length) as shown:
        closed = _closed(job, found, budget, shown)
    job.run.estimate = closed.estimate
    folder.record["loop_closure"] = closed.record
    folder.add_estimate(closed.estimate)
    folder.record["warnings"] += closed.warnings
    job.write_trajectory("trajectory.txt", closed.estimate)


def _localized(job: Job, open_loop: Estimate, prior: PriorMap) -> Estimate:
    threads, part = job.asked["threads"], job.part
    with job.folder.stage("localize"), job.watch.stage("localize", part.length) as shown:
        try:
            found = find_in_map(open_loop, part.batches(shown, Counter()), prior, threads=threads)
        except NotInMapError as error:
            job.folder.record["localization"] = error.record
            raise
    job.folder.record["localization"] = found.record
    return found.estimate


def _closed(job: Job, found: Estimate, budget: Budget, shown: Stage) -> Closed:
    threads, payload = job.asked["threads"], job.part.payload
    batches = job.part.batches(shown, Counter())  # what is dropped was counted in the first pass
    if len(found.segments) > 1 and job.prior is None:
        closed, job.folder.record["merging"] = close_segments(
            found, batches, payload, budget=budget, threads=threads
        )
        # Of the breaks that were guessed more is known now; it comes with the estimate.
        outdated = {*found.warnings} - {*closed.estimate.warnings}
        job.folder.record["warnings"] = [
            w for w in job.folder.record["warnings"] if w not in outdated
        ]
        return closed
    known = None if job.prior is None else job.prior.surfels_near(found.trajectory)
    return close_loops(found, batches, payload, budget=budget, known=known, threads=threads)


def put_on_earth(job: Job) -> Placed | None:
    """Find where on the Earth the map is; one that has no place there is still a map."""
    found, part, folder = job.run.estimate, job.part, job.folder
    if found is None:
        return None
    if job.prior is not None:
        given = job.prior.coordinates
        folder.record["georeference"] = None if given is None else given.record
        return given
    gnss, settings = part.payload.gnss, GeoreferenceSettings(**job.asked["georeferencing"])
    if gnss is None and settings.control_points is None:
        return None
    with folder.stage("georeference"), Progress().stage("", part.length) as unseen:
        try:
            placed = georeference(
                found.trajectory,
                None if gnss is None else part.recording.fixes(part.start, part.duration),
                settings,
                lever_arm=(0.0, 0.0, 0.0) if gnss is None else gnss.lever_arm,
                segments=found.segments,
                reach=part.payload.lidar.max_range,
                chunks=lambda: _projected(job, found, unseen, {}),
            )
        except NotEnoughDataError as error:
            folder.record["warnings"].append(f"{error}; the map stays in its own frame")
            return None
    if placed is not None:
        folder.record["georeference"] = placed.record
        folder.record["warnings"] += placed.warnings
        if placed.trajectory is not found.trajectory:
            job.run.estimate = replace(found, trajectory=placed.trajectory)
            job.write_trajectory("trajectory.txt", job.run.estimate)
    return placed


def write_map(job: Job, placed: Placed | None) -> None:
    """Write the cleaned and thinned map, and what has changed since the one it was found in."""
    found, folder, map_format = job.run.estimate, job.folder, job.asked["map_format"]
    if found is None:
        return
    counts, path = folder.record["counts"], folder.file(f"map.{map_format}")
    difference = None if job.prior is None else Difference(job.prior.cloud, found.trajectory)
    with folder.stage("map"), job.watch.stage("map", job.part.length) as shown:
        chunks = clean(
            _projected(job, found, shown, counts),
            path,
            duration=job.part.length,
            settings=CleanSettings(**job.asked["cleaning"]),
            counts=counts,
            record=folder.record["map"],
            threads=job.asked["threads"],
        )
        if difference is not None:
            chunks = difference.watch(chunks)
        chunks = thin(chunks, job.asked["map_spacing"], counts)
        crs_wkt = None if placed is None else placed.crs_wkt
        with open_map(path, map_format, job.origin_ns, crs_wkt) as writer:
            for chunk in job.run.sample.watch(chunks):
                if placed is not None:
                    chunk = replace(chunk, points=placed.to_projected(chunk.points))
                writer.write(chunk)
        counts["map.written"] = writer.n_points
        if difference is not None:
            _write_changes(job, difference, placed)


def _write_changes(job: Job, difference: Difference, placed: Placed | None) -> None:
    map_format = job.asked["map_format"]
    job.folder.record["localization"] |= difference.record
    clouds = {"appeared": difference.appeared, "disappeared": difference.disappeared}
    for name, points in clouds.items():
        path = job.folder.file(f"{name}.{map_format}")
        with open_map(
            path, map_format, job.origin_ns, None if placed is None else placed.crs_wkt
        ) as writer:
            writer.write(untimed(points if placed is None else placed.to_projected(points)))


def _projected(
    job: Job, found: Estimate, shown: Stage, counts: dict[str, int]
) -> Iterator[MapChunk]:
    return project(
        job.part.batches(shown, Counter()),  # what is dropped was counted in the first pass
        found.trajectory,
        found.calibration,
        segments=found.segments,
        threads=job.asked["threads"],
        counts=counts,
    )
