# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a recording to a run folder: the whole house on one screen."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing import odometry
from bentwing.base.plain import plain
from bentwing.base.progress import Progress
from bentwing.closing.georeference import GeoreferenceSettings
from bentwing.closing.global_registration import GlobalSettings
from bentwing.closing.localize import read_prior_map
from bentwing.map.clean import CleanSettings
from bentwing.map.sample import MapSample
from bentwing.map.writer import require_format
from bentwing.recording import Recording
from bentwing.recording.preprocess import RecordingPart
from bentwing.run import stages
from bentwing.run.checkpoint import Checkpoint
from bentwing.run.folder import RunFolder
from bentwing.run.report import report_run
from bentwing.run.run import Run
from bentwing.run.settings import described_settings, load_payload

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bentwing.closing.localize import PriorMap
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
    prior_map: Path | str | None = None,
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
    estimator : one of `odometry.AVAILABLE_ESTIMATORS`
    map_format : one of `MAP_FORMATS`
    map_spacing : m, edge of the voxels that keep one point each; 0 keeps all points
    cleaning : what is left out of the map; default: mixed pixels and what moved
    georeferencing : how GNSS fixes and control points are used; default: fixes, where the payload
        names their topic, as a rigid fit
    loop_closure : whether places seen again may correct the trajectory
    prior_map : a run folder or a cloud in which the recording is found, and with which it is registered:
        trajectory and map are then in its frame, and what has changed is written too
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
    odometry.require_estimator(estimator)
    head = load_payload(payload)
    engine = odometry.create(estimator, head, settings, threads)
    asked = {
        "estimator": estimator,
        "map_format": map_format,
        "map_spacing": map_spacing,
        "cleaning": plain(cleaning or CleanSettings()),
        "georeferencing": plain(georeferencing or GeoreferenceSettings()),
        "loop_closure": plain(GlobalSettings()) if loop_closure or prior_map else False,
        "prior_map": None if prior_map is None else str(prior_map),
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
                prior = None if prior_map is None else _prior(Path(prior_map), folder)
                folder.add_recordings(recording.paths, recording.clock.start_ns)
            job = stages.Job(run, part, folder, watch, asked, prior)
            checkpoint = Checkpoint(folder)
            done = checkpoint.restore(run) if resume else None
            if done is None:
                stages.estimate(job, engine)
                checkpoint.save("estimate", run)
            if (loop_closure or prior) and done != "loops":
                stages.register(job)
                checkpoint.save("loops", run)
            placed = stages.put_on_earth(job)
            stages.write_map(job, placed)
            with folder.stage("report"):
                folder.save()
                report_run(folder, run, complete=True)
            checkpoint.discard()
    return run


def _prior(path: Path, folder: RunFolder) -> PriorMap:
    prior = read_prior_map(path, GlobalSettings().surfels)
    folder.add_inputs([prior.file])
    return prior


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
