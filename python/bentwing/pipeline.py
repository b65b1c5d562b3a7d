# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a recording to a run folder: the whole house on one screen."""

from __future__ import annotations

from collections import Counter
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from bentwing import estimators
from bentwing.errors import EstimationError, UsageError
from bentwing.map.project import project
from bentwing.map.sample import MapSample
from bentwing.map.thin import thin
from bentwing.map.writer import open_map, require_format
from bentwing.preprocess import preprocess
from bentwing.progress import Progress
from bentwing.recording import ImuBatch, Payload, Recording
from bentwing.report import write_report
from bentwing.report.picture import render_top, write_png
from bentwing.run_folder import RunFolder
from bentwing.run_record import plain
from bentwing.trajectory import Trajectory

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from bentwing.estimators.interface import Estimate, Estimator
    from bentwing.progress import Stage
    from bentwing.recording import Batch

ESTIMATORS = ("continuous", "kalman", "ndt")
AVAILABLE_ESTIMATORS = ("continuous",)


@dataclass(slots=True)
class Run:
    """What a run has found so far; complete when `map_recording` returns.

    Attributes
    ----------
    out : the run folder
    estimate : trajectory, calibration and diagnostics; None before the estimator has ended
    sample : evenly chosen points of the map
    spin_times, spin_rates : s and rad/s, rate of turn of the IMU, about ten a second
    """

    out: Path
    estimate: Estimate | None = None
    sample: MapSample = field(default_factory=MapSample)
    spin_times: list[float] = field(default_factory=list)
    spin_rates: list[float] = field(default_factory=list)


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
    progress: Progress | None = None,
) -> Run:
    """Turn a recording into a trajectory, a map and a report in a folder.

    Parameters
    ----------
    paths : one recording, or its consecutive parts
    payload : the sensor head, or the payload.yaml that describes it
    out : the run folder; see `RunFolder` for what may be there already
    estimator : one of `AVAILABLE_ESTIMATORS`
    map_format : one of `MAP_FORMATS`
    map_spacing : m, edge of the voxels that keep one point each; 0 keeps all points
    loop_closure : whether places seen again may correct the trajectory
    settings : of the estimator; default: its defaults
    threads : of the estimator; default: all cores
    start, duration : s, the part of the recording to use; default: all of it
    progress : what to tell the user meanwhile; default: nothing

    Raises
    ------
    UsageError, InputError, EstimationError
        With an EstimationError what was computed is kept in `out`, and run.json says how far.
    """
    require_format(map_format)
    require_estimator(estimator)
    head = _loaded(payload)
    engine = estimators.create(estimator, head, settings, threads)
    asked = {
        "estimator": estimator,
        "map_format": map_format,
        "map_spacing": map_spacing,
        "loop_closure": loop_closure,
        "threads": threads,
        "start": start,
        "duration": duration,
        **_described(estimator, engine, head),
    }
    watch = progress or Progress()
    with Recording(paths, head) as recording, RunFolder(Path(out), asked) as folder:
        run, counts = Run(folder.path), Counter[str]()
        origin_ns = recording.clock.start_ns
        total = min(recording.duration - (start or 0.0), duration or np.inf)
        with _reported(folder, run):
            with folder.stage("inputs"):
                folder.add_inputs(recording.paths)
            with folder.stage("estimate"), watch.stage("estimate", total) as stage:
                batches = preprocess(recording.batches(start, duration), head, counts)
                run.estimate = _estimate(engine, _watched(batches, stage, run), folder, origin_ns)
            folder.record["counts"].update(recording.counts + counts)
            folder.record["warnings"] += recording.warnings
            folder.add_estimate(run.estimate)
            for name in ("odometry.txt", "trajectory.txt"):
                folder.write_trajectory(name, run.estimate.trajectory, origin_ns)
            with folder.stage("map"), watch.stage("map", total) as stage:
                batches = preprocess(recording.batches(start, duration), head, Counter())
                chunks = project(
                    _watched(batches, stage),
                    run.estimate.trajectory,
                    run.estimate.calibration,
                    encoder=head.encoder,
                    counts=folder.record["counts"],
                )
                chunks = thin(chunks, map_spacing, folder.record["counts"])
                map_path = folder.file(f"map.{map_format}")
                with open_map(map_path, map_format, origin_ns) as writer:
                    for chunk in run.sample.watch(chunks):
                        writer.write(chunk)
            with folder.stage("report"):
                folder.save()
                _report(folder, run, complete=True)
    return run


def require_estimator(name: str) -> None:
    """Refuse an estimator that does not exist, before anything is read."""
    if name not in ESTIMATORS:
        msg = f"estimator {name!r} is not known; choose one of {', '.join(AVAILABLE_ESTIMATORS)}"
        raise UsageError(msg)
    if name not in AVAILABLE_ESTIMATORS:
        msg = f"the estimator {name!r} is not in this version; use {' or '.join(AVAILABLE_ESTIMATORS)}"
        raise UsageError(msg)


def settings_text(estimator: str, payload: Payload | Path | str | None) -> str:
    """Return the estimator's settings and the sensor head, defaults included, as YAML."""
    require_estimator(estimator)
    head = _loaded(payload)
    engine = estimators.create(estimator, head, None, None)
    return yaml.safe_dump(_described(estimator, engine, head), sort_keys=False)


def _described(estimator: str, engine: Estimator, head: Payload) -> dict[str, Any]:
    return {estimator: plain(getattr(engine, "settings", None)), "payload": plain(head)}


def _loaded(payload: Payload | Path | str | None) -> Payload:
    if isinstance(payload, Payload):
        return payload
    return Payload.default() if payload is None else Payload.load(payload)


def _estimate(
    engine: Estimator, batches: Iterable[Batch], folder: RunFolder, origin_ns: int
) -> Estimate:
    try:
        for batch in batches:
            engine.feed(batch)
    except EstimationError:
        # the trajectory up to the failure shows where it went wrong
        with suppress(EstimationError):
            folder.write_trajectory("odometry.txt", engine.result().trajectory, origin_ns)
        raise
    return engine.result()


def _watched(batches: Iterable[Batch], stage: Stage, run: Run | None = None) -> Iterator[Batch]:
    """Pass batches on, telling the progress and noting the rate of turn."""
    reached: float | None = None
    for batch in batches:
        yield batch
        if not len(batch.times):
            continue
        if run is not None and isinstance(batch, ImuBatch):
            run.spin_times.append(float(batch.times.mean()))
            run.spin_rates.append(float(np.median(np.linalg.norm(batch.gyro, axis=1))))
        last = float(batch.times[-1])
        reached = last if reached is None else reached
        stage.advance(max(last - reached, 0.0))
        reached = max(last, reached)


@contextmanager
def _reported(folder: RunFolder, run: Run) -> Iterator[None]:
    """Write a report without a map when the run fails, so that none of an earlier run remains."""
    try:
        yield
    except BaseException as error:
        folder.fail(error)
        run.sample = MapSample()
        _report(folder, run, complete=False)
        raise


def _report(folder: RunFolder, run: Run, *, complete: bool) -> None:
    trajectory = _NO_TRAJECTORY if run.estimate is None else run.estimate.trajectory
    points = run.sample.points
    spin: tuple[NDArray[np.float64], NDArray[np.float64]] = (
        np.array(run.spin_times),
        np.array(run.spin_rates),
    )
    write_report(
        folder.file("report.html"),
        run_json={**folder.record, "complete": complete},
        trajectory=trajectory,
        map_sample=(points, run.sample.times),
        spin=spin if len(spin[0]) else None,
    )
    if len(points):
        write_png(folder.file("map_top.png"), render_top(points))


_NO_TRAJECTORY = Trajectory(np.empty(0), np.empty((0, 3)), np.empty((0, 4)))
