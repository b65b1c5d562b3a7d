# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a recording to a run folder: the whole house on one screen."""

from __future__ import annotations

from collections import Counter
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing import estimators
from bentwing.checkpoint import Checkpoint
from bentwing.errors import EstimationError, NotEnoughDataError
from bentwing.georeference import Georeferenced, GeoreferenceSettings, georeference
from bentwing.global_registration import Budget, GlobalSettings, close_loops
from bentwing.map.clean import CleanSettings, clean
from bentwing.map.project import project
from bentwing.map.sample import MapSample
from bentwing.map.thin import thin
from bentwing.map.writer import open_map, require_format
from bentwing.preprocess import RecordingPart
from bentwing.progress import Progress
from bentwing.recording import Recording
from bentwing.report import report_run
from bentwing.run import Run
from bentwing.run_folder import RunFolder
from bentwing.run_record import plain
from bentwing.run_settings import described_settings, load_payload

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bentwing.estimators.interface import Estimate, Estimator
    from bentwing.map.chunk import MapChunk
    from bentwing.progress import Stage
    from bentwing.recording import Payload


def map_recording(
    paths: Path | str | Sequence[Path | str],
    payload: Payload | Path | str | None,
    out: Path | str,
    *,
    estimator: str = "continuous",
    map_format: str = "laz",
    map_spacing: float = 0.0,
    cleaning: CleanSettings | None = None,
    georeferencing: GeoreferenceSettings | None = None,
    loop_closure: bool = True,
    settings: Any = None,  # noqa: ANN401 - each estimator has its own model
    threads: int | None = None,
    start: float | None = None,
    duration: float | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> Run:
    """Turn a recording into a trajectory, a map and a report in a folder.

    Parameters
    ----------
    paths : one recording, or its consecutive parts
    payload : the sensor head, or the payload.yaml that describes it
    out : the run folder; see `RunFolder` for what may be there already
    estimator : one of `estimators.AVAILABLE_ESTIMATORS`
    map_format : one of `MAP_FORMATS`
    map_spacing : m, edge of the voxels that keep one point each; 0 keeps all points
    cleaning : what is left out of the map; default: mixed pixels and what moved
    georeferencing : how GNSS fixes and control points are used; default: fixes, where the payload
        names their topic, as a rigid fit
    loop_closure : whether places seen again may correct the trajectory
    settings : of the estimator; default: its defaults
    threads : of the estimator; default: all cores
    start, duration : s, the part of the recording to use; default: all of it
    resume : go on behind the last stage that an earlier run in `out` has finished, if there is one
    progress : what to tell the user meanwhile; default: nothing

    Raises
    ------
    UsageError, InputError, EstimationError
        With an EstimationError what was computed is kept in `out`, and run.json says how far.
    """
    require_format(map_format)
    estimators.require_estimator(estimator)
    head = load_payload(payload)
    engine = estimators.create(estimator, head, settings, threads)
    asked = {
        "estimator": estimator,
        "map_format": map_format,
        "map_spacing": map_spacing,
        "cleaning": plain(cleaning or CleanSettings()),
        "georeferencing": plain(georeferencing or GeoreferenceSettings()),
        "loop_closure": plain(GlobalSettings()) if loop_closure else False,
        "threads": threads,
        "start": start,
        "duration": duration,
        **described_settings(estimator, engine, head),
    }
    with Recording(paths, head) as recording, RunFolder(Path(out), asked) as folder:
        part, run = RecordingPart(recording, head, start, duration), Run(folder.path)
        watch = progress or Progress()
        with _reported(folder, run):
            with folder.stage("inputs"):
                described = [Path(payload)] if isinstance(payload, (str, Path)) else []
                folder.add_inputs([*recording.paths, *described])
            checkpoint = Checkpoint(folder)
            done = checkpoint.restore(run) if resume else None
            if done is None:
                with folder.stage("estimate"), watch.stage("estimate", part.length) as shown:
                    _estimate(engine, part, shown, folder, run)
                checkpoint.save("estimate", run)
            if loop_closure and done != "loops":
                _close_loops(run, part, watch, folder, threads)
                checkpoint.save("loops", run)
            placed = _georeference(run, part, folder, asked)
            with folder.stage("map"), watch.stage("map", part.length) as shown:
                _write_map(run, part, shown, folder, asked, placed=placed)
            with folder.stage("report"):
                folder.save()
                report_run(folder, run, complete=True)
            checkpoint.discard()
    return run


def _estimate(
    engine: Estimator, part: RecordingPart, shown: Stage, folder: RunFolder, run: Run
) -> None:
    counts, origin_ns = Counter[str](), part.recording.clock.start_ns
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
            folder.write_trajectory("odometry.txt", run.estimate, origin_ns)
    folder.write_trajectory("trajectory.txt", run.estimate, origin_ns)


def _close_loops(
    run: Run, part: RecordingPart, watch: Progress, folder: RunFolder, threads: int | None
) -> None:
    if run.estimate is None:
        return
    settings = GlobalSettings()
    budget = Budget.of(part.length, settings)
    watch.note(f"loops: {budget.sentence()}")
    with folder.stage("loops"), watch.stage("loops", part.length) as shown:
        batches = part.batches(shown, Counter())  # what is dropped was counted in the first pass
        closed = close_loops(
            run.estimate, batches, part.payload, settings=settings, budget=budget, threads=threads
        )
    run.estimate = closed.estimate
    folder.record["loop_closure"] = closed.record
    folder.add_estimate(run.estimate)
    folder.write_trajectory("trajectory.txt", run.estimate, part.recording.clock.start_ns)


def _georeference(
    run: Run, part: RecordingPart, folder: RunFolder, asked: dict[str, Any]
) -> Georeferenced | None:
    """Put the estimate on the Earth; a map that has no place there is still a map."""
    estimate, gnss = run.estimate, part.payload.gnss
    settings = GeoreferenceSettings(**asked["georeferencing"])
    if estimate is None or (gnss is None and settings.control_points is None):
        return None
    with folder.stage("georeference"), Progress().stage("", part.length) as unseen:
        try:
            placed = georeference(
                estimate.trajectory,
                None if gnss is None else part.recording.fixes(part.start, part.duration),
                settings,
                lever_arm=(0.0, 0.0, 0.0) if gnss is None else gnss.lever_arm,
                segments=estimate.segments,
                reach=part.payload.lidar.max_range,
                chunks=lambda: _projected(estimate, part, unseen, asked, {}),
            )
        except NotEnoughDataError as error:
            folder.record["warnings"].append(f"{error}; the map stays in its own frame")
            return None
    if placed is not None:
        folder.record["georeference"] = placed.record
        folder.record["warnings"] += placed.warnings
        if placed.trajectory is not estimate.trajectory:
            run.estimate = replace(estimate, trajectory=placed.trajectory)
            origin_ns = part.recording.clock.start_ns
            folder.write_trajectory("trajectory.txt", run.estimate, origin_ns)
    return placed


def _projected(
    estimate: Estimate,
    part: RecordingPart,
    shown: Stage,
    asked: dict[str, Any],
    counts: dict[str, int],
) -> Iterator[MapChunk]:
    return project(
        part.batches(shown, Counter()),  # what is dropped was counted in the first pass
        estimate.trajectory,
        estimate.calibration,
        segments=estimate.segments,
        threads=asked["threads"],
        counts=counts,
    )


def _write_map(
    run: Run,
    part: RecordingPart,
    shown: Stage,
    folder: RunFolder,
    asked: dict[str, Any],
    *,
    placed: Georeferenced | None,
) -> None:
    if run.estimate is None:
        return
    counts = folder.record["counts"]
    chunks = _projected(run.estimate, part, shown, asked, counts)
    path = folder.file(f"map.{asked['map_format']}")
    chunks = clean(
        chunks,
        path,
        duration=part.length,
        settings=CleanSettings(**asked["cleaning"]),
        counts=counts,
        record=folder.record["map"],
        threads=asked["threads"],
    )
    chunks = thin(chunks, asked["map_spacing"], counts)
    origin_ns = part.recording.clock.start_ns
    crs_wkt = None if placed is None else placed.crs_wkt
    with open_map(path, asked["map_format"], origin_ns, crs_wkt) as writer:
        for chunk in run.sample.watch(chunks):
            if placed is not None:
                chunk = replace(chunk, points=placed.to_projected(chunk.points))
            writer.write(chunk)
    counts["map.written"] = writer.n_points


@contextmanager
def _reported(folder: RunFolder, run: Run) -> Iterator[None]:
    """Write a report without a map when the run fails, so that none of an earlier run remains."""
    try:
        yield
    except BaseException as error:
        folder.fail(error)
        run.sample = MapSample()
        report_run(folder, run, complete=False)
        raise
