# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a recording to a run folder: the whole method on one screen."""

from __future__ import annotations

from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from bentwing import odometry
from bentwing.base.progress import as_progress
from bentwing.closing.loop_file import read_loops
from bentwing.recording.frames import placed_payload
from bentwing.recording.ready import payload_path
from bentwing.recording.sections.project import as_project
from bentwing.run import stages
from bentwing.run.beams import read_by
from bentwing.run.check import opened
from bentwing.run.checkpoint import NAME as CHECKPOINT
from bentwing.run.checkpoint import Checkpoint
from bentwing.run.choose import as_run_settings
from bentwing.run.estimate import estimate
from bentwing.run.folder import RunFolder
from bentwing.run.report import report_failure, report_run, say_warnings
from bentwing.run.request import request_of
from bentwing.run.run import COVARIANCES, Run

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bentwing.base.progress import Progress
    from bentwing.closing.georeference.settings import GeoreferenceSettings
    from bentwing.closing.localize import PriorMap
    from bentwing.map import MapFormat
    from bentwing.map.clean import CleanSettings
    from bentwing.odometry import EstimatorName, EstimatorSettings
    from bentwing.recording.payload import PayloadLike
    from bentwing.recording.sections.project import Project
    from bentwing.run.found import Found
    from bentwing.run.settings import RunSettings


def map_recording(
    paths: Path | str | Sequence[Path | str],
    payload: PayloadLike,
    out: Path | str,
    *,
    estimator: EstimatorName | None = None,
    map_format: MapFormat | None = None,
    map_spacing: float | None = None,
    cleaning: CleanSettings | None = None,
    refine: bool = True,
    normals: bool | None = None,
    georeferencing: GeoreferenceSettings | None = None,
    project: Project | Path | str | None = None,
    loop_closure: bool = True,
    loops: Path | str | None = None,
    write_map: bool = True,
    prior_map: Path | str | None = None,
    settings: EstimatorSettings | Path | str | None = None,
    threads: int | None = None,
    start: float | None = None,
    duration: float | None = None,
    trust_payload: bool = False,
    force: bool = False,
    resume: bool = False,
    progress: Progress | None = None,
) -> Run:
    """Turn a recording into a trajectory, a map and a report in a folder.

    Parameters
    ----------
    paths : one recording, or its consecutive parts
    payload : the sensor head, or the payload.yaml that describes it
    out : the run folder; see `RunFolder` for what may be there already
    estimator : one of `ESTIMATORS`; default: `continuous`
    map_format : one of `MAP_FORMATS`; default: `laz`
    map_spacing : m, edge of the voxels that keep one point each; default: 0, which keeps all points
    cleaning : what the map leaves out; default: mixed pixels and what moved
    refine : whether points are moved along their beams to the surface that they measured together
    normals : whether points have the normal of their surface, towards the lidar; default: no
    georeferencing : how GNSS fixes and control points are used; default: fixes, where the payload
        names their topic, as a rigid fit
    project : what the first page of the report names, or a YAML file of it; default: the payload's
    loop_closure : whether places seen again may correct the trajectory
    loops : YAML file of times at which the same place was seen, or was not, as you know
    write_map : whether there is a map; without one the run ends with its trajectory, much sooner
    prior_map : a run folder or a cloud in which the recording is localized: trajectory and map are
        then in its frame, and the points that have changed are written too
    settings : of the estimator, or a YAML file of what `bentwing map --print-settings` prints, all or
        some of it, over which the other arguments stand; default: the defaults
    threads : of the estimator; default: all cores
    start, duration : s, the part of the recording to use; default: all of it
    trust_payload : take the head as the payload says, even where the recording shows another set-up
    force : map a recording that `bentwing info` calls unfit all the same
    resume : go on behind the last stage that an earlier run in `out` has finished, if there is one
    progress : what to tell the user meanwhile; default: nothing

    Raises
    ------
    UsageError, InputError, EstimationError
        With an EstimationError what was computed is kept in `out`, and run.json says how far.
    """
    chosen = as_run_settings(
        payload=payload,
        settings=settings,
        estimator=estimator,
        map_format=map_format,
        map_spacing=map_spacing,
        cleaning=cleaning,
        refine=None if refine else False,
        normals=normals,
        georeferencing=georeferencing,
        project=as_project(project),
        loop_closure=None if loop_closure else False,
        loops=None if loops is None else read_loops(Path(loops)),
        writes_map=None if write_map else False,
        prior_map=prior_map,
        threads=threads,
        start=start,
        duration=duration,
        trust_payload=True if trust_payload else None,
        force=True if force else None,
    )
    described = payload_path(payload) if isinstance(payload, (str, Path)) else None
    found = run_recording(paths, out, chosen, described, resume=resume, progress=progress)
    return Run.of(Path(out), found)


def run_recording(
    paths: Path | str | Sequence[Path | str],
    out: Path | str,
    settings: RunSettings,
    payload_file: Path | str | None = None,
    *,
    resume: bool = False,
    progress: Progress | None = None,
) -> Found:
    """Map a recording as its settings say; see `map_recording`.

    Parameters
    ----------
    payload_file : that `settings.payload` was read from; it counts as an input

    Returns
    -------
    What the stages have found; `Run.of` makes a run of it.
    """
    watch = as_progress(progress)
    read = [path for path in (settings.prior_map, payload_file) if path is not None]
    asked, settings = settings, _placed(paths, settings)
    # Refuses at once what the estimator cannot do.
    odometry.create(settings.estimator, settings.payload, settings.of_estimator, settings.threads)
    with (
        opened(paths, settings, watch) as head,
        RunFolder(Path(out), settings.to_json(), resume=resume, inputs=map(Path, read)) as folder,
        head.keeping(folder.path),
    ):
        folder.record.settings = head.settings.to_json()
        job = stages.Job(head.part, folder, head.settings, watch)
        with _reported(folder, watch):
            job = replace(job, prior=_open_inputs(job, payload_file))
            folder.record.request = request_of(asked, folder.record.inputs)
            checkpoint = Checkpoint(folder, settings)
            done, found = checkpoint.restore(resume=resume)
            folder.remove_earlier()
            if found.set_up is not None and found.set_up != head.set_up:
                head.use(found.set_up)
                job = replace(job, part=head.part, settings=head.settings)
            if done is not None and found.beams is not None:
                job = read_by(job, head, found.beams)
            if done is None:
                job, found = estimate(job, found, head)
                found = _keep(job, found, open_loop=True)
                checkpoint.save("estimate", found)
            if settings.closes_loops and done != "loops":
                found = _keep(job, stages.close(job, found))
                checkpoint.save("loops", found)
            found = _keep(job, stages.place_on_earth(job, found))
            last = stages.make_map if settings.writes_map else stages.leave_without_map
            found = _keep(job, last(job, found))
            report_run(folder, found)
            checkpoint.discard()
    return replace(found, payload=head.settings.payload)


def _placed(paths: Path | str | Sequence[Path | str], settings: RunSettings) -> RunSettings:
    """Return the settings with what their payload refers to in the recording."""
    if not settings.payload.refers_to_recording:
        return settings
    listed = [Path(paths)] if isinstance(paths, (str, Path)) else [*map(Path, paths)]
    return settings.model_copy(update={"payload": placed_payload(listed, settings.payload)})


def _open_inputs(job: stages.Job, payload_file: Path | str | None) -> PriorMap | None:
    """Record what the run reads; return the prior map."""
    folder, recording, prior = job.folder, job.part.recording, job.settings.prior_map
    with folder.stage("inputs"):
        described = [] if payload_file is None else [Path(payload_file)]
        folder.add_inputs([*recording.paths, *described])
        known = None
        if prior is not None:
            from bentwing.closing.localize import read_prior_map

            known = read_prior_map(prior, job.settings.closing.surfels)
            folder.add_inputs([known.file])
        folder.add_recordings(recording.paths, recording.clock.start_ns)
    return known


def _keep(job: stages.Job, found: Found, *, open_loop: bool = False) -> Found:
    """Write the trajectory and record what was found; raise if the stage did not finish."""
    before, job.folder.record.found = job.folder.record.found, found
    if found.estimate is not None and open_loop:
        job.folder.write_trajectory("odometry.txt", found.estimate, job.origin_ns)
    if found.failure is not None:
        raise found.failure
    if found.estimate is not None and found.estimate is not before.estimate:
        job.folder.write_trajectory("trajectory.txt", found.estimate, job.origin_ns)
        job.folder.write_covariances(COVARIANCES, found.estimate, job.origin_ns)
    return found


@contextmanager
def _reported(folder: RunFolder, progress: Progress) -> Iterator[None]:
    """Say the warnings at the end, and report a failure before it leaves."""
    try:
        yield
    except OSError as error:
        with suppress(OSError):  # a disk that is full has no room for the report either
            report_failure(folder, error)
        raise _with_what_is_kept(error, folder) from error
    except BaseException as error:
        report_failure(folder, error)
        raise
    finally:
        say_warnings(progress, folder.record.found.warnings)


def _with_what_is_kept(error: OSError, folder: RunFolder) -> OSError:
    is_kept = (folder.path / CHECKPOINT).exists()
    kept = (
        "what was estimated is kept, --resume goes on behind it" if is_kept else "nothing is kept"
    )
    return OSError(error.errno, f"{error.strerror or error}; {kept}", error.filename)
