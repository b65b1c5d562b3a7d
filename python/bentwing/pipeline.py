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
from bentwing.report.views import overhead_points
from bentwing.run_folder import RunFolder
from bentwing.run_record import plain
from bentwing.trajectory import Trajectory

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from bentwing.estimators.interface import Estimate, Estimator
    from bentwing.progress import Stage
    from bentwing.recording import Batch

ESTIMATORS = ("continuous", "kalman", "ndt")
AVAILABLE_ESTIMATORS = ("continuous",)
_NO_LOOP_CLOSURE = "not in this version, the trajectory is open-loop"


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
        "loop_closure": _NO_LOOP_CLOSURE if loop_closure else False,
        "threads": threads,
        "start": start,
        "duration": duration,
        **_described(estimator, engine, head),
    }
    with Recording(paths, head) as recording, RunFolder(Path(out), asked) as folder:
        part, run = _Part(recording, head, start, duration), Run(folder.path)
        watch = progress or Progress()
        with _reported(folder, run):
            with folder.stage("inputs"):
                folder.add_inputs(recording.paths)
                folder.add_inputs([Path(payload)] if isinstance(payload, (str, Path)) else [])
            with folder.stage("estimate"), watch.stage("estimate", part.length) as shown:
                run.estimate = _estimate(engine, part, shown, folder, run)
            with folder.stage("map"), watch.stage("map", part.length) as shown:
                _write_map(run, part, shown, folder, map_format=map_format, map_spacing=map_spacing)
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


@dataclass(frozen=True, slots=True)
class _Part:
    """The part of a recording to use, as a stream that can be asked for again."""

    recording: Recording
    head: Payload
    start: float | None
    duration: float | None

    @property
    def length(self) -> float:
        """Seconds of the recording to go through."""
        left = self.recording.duration - (self.start or 0.0)
        return left if self.duration is None else min(left, self.duration)

    def batches(self, shown: Stage, counts: Counter[str]) -> Iterator[Batch]:
        """Stream the preprocessed batches, telling the progress."""
        reached = self.start or 0.0
        for batch in preprocess(
            self.recording.batches(self.start, self.duration), self.head, counts
        ):
            yield batch
            if len(batch.times) and batch.times[-1] > reached:
                shown.advance(float(batch.times[-1]) - reached)
                reached = float(batch.times[-1])


def _estimate(
    engine: Estimator, part: _Part, shown: Stage, folder: RunFolder, run: Run
) -> Estimate:
    counts, origin_ns = Counter[str](), part.recording.clock.start_ns
    try:
        for batch in part.batches(shown, counts):
            engine.feed(batch)
            if isinstance(batch, ImuBatch) and len(batch.times):
                run.spin_times.append(float(batch.times.mean()))
                run.spin_rates.append(float(np.median(np.linalg.norm(batch.gyro, axis=1))))
    except EstimationError:
        # the trajectory up to the failure shows where it went wrong
        with suppress(EstimationError):
            folder.write_trajectory("odometry.txt", engine.result().trajectory, origin_ns)
        raise
    estimate = engine.result()
    folder.record["counts"].update(part.recording.counts + counts)
    folder.record["warnings"] += part.recording.warnings
    folder.add_estimate(estimate)
    for name in ("odometry.txt", "trajectory.txt"):
        folder.write_trajectory(name, estimate.trajectory, origin_ns)
    return estimate


def _write_map(
    run: Run,
    part: _Part,
    shown: Stage,
    folder: RunFolder,
    *,
    map_format: str,
    map_spacing: float,
) -> None:
    if run.estimate is None:
        return
    chunks = project(
        part.batches(shown, Counter()),  # what is dropped was counted in the first pass
        run.estimate.trajectory,
        run.estimate.calibration,
        encoder=part.head.encoder,
        counts=folder.record["counts"],
    )
    chunks = thin(chunks, map_spacing, folder.record["counts"])
    path = folder.file(f"map.{map_format}")
    with open_map(path, map_format, part.recording.clock.start_ns) as writer:
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
        overhead = overhead_points(points, run.sample.times, trajectory)
        write_png(folder.file("map_top.png"), render_top(points[~overhead]))


_NO_TRAJECTORY = Trajectory(np.empty(0), np.empty((0, 3)), np.empty((0, 4)))
