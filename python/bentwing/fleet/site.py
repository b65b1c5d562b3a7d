# SPDX-License-Identifier: MIT OR Apache-2.0
"""Many recordings into one folder of runs, and into merged maps: the whole on one screen."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.progress import Progress, as_progress
from bentwing.base.regular_file import resolved
from bentwing.base.result_folder import ResultFolder
from bentwing.fleet.discover import find_recordings
from bentwing.fleet.folder import RECORDINGS, SITE_FOLDER
from bentwing.fleet.joining import complete, merged_site
from bentwing.fleet.manifest import MANIFEST_SUFFIXES, read_manifest
from bentwing.fleet.mirror import Mirror
from bentwing.fleet.opened import LazyPool, on_cluster
from bentwing.fleet.plan import Choice, plan
from bentwing.fleet.pool import Job
from bentwing.fleet.record import Site
from bentwing.fleet.scratch import scratch_folder
from bentwing.fleet.skeleton import Skeleton
from bentwing.fleet.store import is_url
from bentwing.fleet.task import Mapped, finished, map_recording_of, sentence_of
from bentwing.recording.ready import payload_path
from bentwing.run.settings import merge_settings

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bentwing.fleet.entry import Entry
    from bentwing.fleet.opened import Opened
    from bentwing.fleet.task import MapTask
    from bentwing.map import MapFormat
    from bentwing.odometry import EstimatorName
    from bentwing.run.settings import MergeSettings


def map_fleet(
    recordings: Path | str | Sequence[Path | str],
    out: Path | str,
    *,
    payload: Path | str | None = None,
    settings: Path | str | None = None,
    estimator: EstimatorName | None = None,
    map_format: MapFormat | None = None,
    map_spacing: float | None = None,
    threads: int | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    client: Any = None,  # noqa: ANN401 - of dask.distributed, which may not be installed
    progress: Progress | None = None,
) -> Site:
    """Map many recordings on a cluster of dask.distributed, and merge those that belong together.

    What an earlier call has finished in the same way is left as it is: same inputs, settings and
    version. A recording that cannot be mapped does not stop the others.

    Parameters
    ----------
    recordings : a manifest, or folders of recordings; also in a store, by URL
    out : folder of the result, or a URL
    payload : description of the head of recordings that have none of their own
    settings : YAML file of what `bentwing map --print-settings` prints, all or some of it
    estimator, map_format, map_spacing : as `map_recording` takes them
    threads : of each recording; default: on this machine its cores among the workers
    workers : of a cluster that is started on this machine; default: two where memory allows
    scheduler : address of a running one instead; default: the environment's DASK_ADDRESS
    client : of dask.distributed, to be used instead
    progress : what to tell the user meanwhile; default: nothing

    Raises
    ------
    UsageError, InputError
        If the list of recordings cannot be read, or there is no cluster.
    """
    from bentwing.run.choose import given

    options = given(
        estimator=estimator, map_format=map_format, map_spacing=map_spacing, threads=threads
    )
    paths = [recordings] if isinstance(recordings, (str, Path)) else list(recordings)
    choice = Choice(
        None if settings is None else Path(settings),
        (),
        None if payload is None else payload_path(payload),
        options,
    )
    shown = as_progress(progress)
    opened = on_cluster(threads, shown, workers=workers, scheduler=scheduler, client=client)
    return map_site(paths, out, choice, opened, shown)


def map_site(
    paths: Sequence[Path | str],
    out: Path | str,
    choice: Choice,
    opened: Opened,
    progress: Progress,
    *,
    merges: bool = True,
) -> Site:
    """Map the recordings that paths list or hold, each into a folder of its own; see `map_fleet`.

    Parameters
    ----------
    opened : opens the pool that the work runs in, once there is some
    merges : whether the runs are merged; then they are in a sub-folder of `out`, else in `out` itself
    """
    with Skeleton() as skeleton:
        with skeleton.named():
            found = _Found.at(paths, skeleton)
        choice.settings()  # what is wrong with all of them is no matter of one
        if not is_url(out):
            return _map_found(found, Path(out), choice, opened, progress, merges=merges)
        with scratch_folder() as scratch:
            mirror = Mirror(str(out), scratch / "site")
            away = mirror.opened(opened)
            return mirror.finish(_map_found(found, mirror.folder, choice, away, progress))


def _map_found(
    found: _Found,
    out: Path,
    choice: Choice,
    opened: Opened,
    progress: Progress,
    *,
    merges: bool = True,
) -> Site:
    runs = out / RECORDINGS if merges else out
    with ResultFolder(out, SITE_FOLDER, found.files()) as folder, ExitStack() as stack:
        runs.mkdir(exist_ok=True)
        tasks, refused = plan(found.entries, resolved(runs), choice)
        refused = [replace(one, reason=found.skeleton.said(one.reason)) for one in refused]
        pool = LazyPool(opened, stack)
        mapped = {one.name: one for one in [*refused, *_map(tasks, pool, progress)]}
        site = Site(out, [mapped[entry.name] for entry in found.entries])
        if merges:
            site = merged_site(site, _merging_of(choice), pool, progress)
        complete(folder, site, found.manifests)
    return site


@dataclass(frozen=True, slots=True)
class _Found:
    """Recordings, the manifests that list them, and the stores that hold them."""

    entries: list[Entry]
    manifests: list[Path]
    skeleton: Skeleton

    @classmethod
    def at(cls, given: Sequence[Path | str], skeleton: Skeleton) -> _Found:
        """Find the recordings that paths list or hold."""
        paths = [skeleton.path(path) for path in given]
        manifests: list[Path] = []
        if len(paths) == 1 and paths[0].suffix in MANIFEST_SUFFIXES and not paths[0].is_dir():
            entries, manifests = read_manifest(paths[0]), paths
        else:
            entries = find_recordings(paths)
        return cls([skeleton.entry(entry) for entry in entries], manifests, skeleton)

    def files(self) -> list[Path]:
        """Return what is read of the file systems here."""
        parts = [part for entry in self.entries for part in entry.parts]
        return [*self.manifests, *(part for part in parts if isinstance(part, Path))]


def _map(tasks: Sequence[MapTask], pool: LazyPool, progress: Progress) -> Iterator[Mapped]:
    """Yield what came of each recording, those first that are there already."""
    todo = []
    for task in tasks:
        done = finished(task)
        if done is None:
            todo.append(Job(task.key, map_recording_of, task, task.megabytes))
        else:
            yield done
    # The largest first: one that is begun last keeps all others waiting.
    todo.sort(key=lambda job: -job.megabytes)
    if len(todo) < len(tasks):
        progress.note(f"{len(tasks) - len(todo)} of {len(tasks)} recordings are mapped already")
    for number, (job, result) in enumerate(pool.results(todo), start=1):
        one = _of_result(job.task, result)
        progress.note(f"[{number}/{len(todo)}] {one.name}: {sentence_of(one.state, one.reason)}")
        yield one


def _of_result(task: MapTask, result: Mapped | BaseException) -> Mapped:
    """Return what came of a recording; raise what is no matter of one."""
    if isinstance(result, Mapped):
        return result
    if not isinstance(result, Exception):
        raise result
    reason = str(result) or type(result).__name__
    return Mapped(task.name, "failed", reason, request=task.request)


def _merging_of(choice: Choice) -> MergeSettings:
    """Return how the runs are merged, by what is the same for all recordings."""
    settings = choice.settings()
    named = (
        "map_format",
        "map_spacing",
        "cleaning",
        "refine",
        "normals",
        "georeferencing",
        "project",
    )
    wanted = {name: getattr(settings, name) for name in settings.model_fields_set & {*named}}
    return merge_settings(**wanted, loop_closure=settings.closing)
