# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a recording to a run folder: the whole house on one screen."""

from __future__ import annotations

from collections import Counter
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing import estimators
from bentwing.checkpoint import Checkpoint
from bentwing.errors import EstimationError
from bentwing.estimators.segments import GUESSED
from bentwing.global_registration import Budget, GlobalSettings, close_loops
from bentwing.map.project import project
from bentwing.map.sample import MapSample
from bentwing.map.thin import thin
from bentwing.map.writer import open_map, require_format
from bentwing.merging.segments import close_segments
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
                folder.add_recordings(recording.paths, recording.clock.start_ns)
            checkpoint = Checkpoint(folder)
            done = checkpoint.restore(run) if resume else None
            if done is None:
                with folder.stage("estimate"), watch.stage("estimate", part.length) as shown:
                    _estimate(engine, part, shown, folder, run)
                checkpoint.save("estimate", run)
            if loop_closure and done != "loops":
                _close_loops(run, part, watch, folder, threads)
                checkpoint.save("loops", run)
            with folder.stage("map"), watch.stage("map", part.length) as shown:
                _write_map(run, part, shown, folder, asked)
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
        if len(run.estimate.segments) > 1:
            closed, folder.record["merging"] = close_segments(
                run.estimate, batches, part.payload, budget=budget, threads=threads
            )
            _forget_guesses(folder, closed.estimate)
        else:
            closed = close_loops(
                run.estimate,
                batches,
                part.payload,
                settings=settings,
                budget=budget,
                threads=threads,
            )
    run.estimate = closed.estimate
    folder.record["loop_closure"] = closed.record
    folder.add_estimate(run.estimate)
    folder.write_trajectory("trajectory.txt", run.estimate, part.recording.clock.start_ns)


def _forget_guesses(folder: RunFolder, merged: Estimate) -> None:
    """Take back the warnings of breaks that were healed; what is true now is added with the estimate."""
    folder.record["warnings"] = [
        w for w in folder.record["warnings"] if GUESSED not in w or w in merged.warnings
    ]


def _write_map(
    run: Run, part: RecordingPart, shown: Stage, folder: RunFolder, asked: dict[str, Any]
) -> None:
    if run.estimate is None:
        return
    counts = folder.record["counts"]
    chunks = project(
        part.batches(shown, Counter()),  # what is dropped was counted in the first pass
        run.estimate.trajectory,
        run.estimate.calibration,
        segments=run.estimate.segments,
        threads=asked["threads"],
        counts=counts,
    )
    chunks = thin(chunks, asked["map_spacing"], counts)
    path = folder.file(f"map.{asked['map_format']}")
    with open_map(path, asked["map_format"], part.recording.clock.start_ns) as writer:
        for chunk in run.sample.watch(chunks):
            writer.write(chunk)


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
