# SPDX-License-Identifier: MIT OR Apache-2.0
"""A site in a store: its records have a copy at the client, and whoever makes a result sends it there.

Nothing on a worker's disk is needed by another one: each piece of work fetches what it needs into a
folder of its own, and sends what it has made.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import BentwingError, InputError
from bentwing.fleet.folder import GROUPS, PAGE, RECORDINGS, SITE_FOLDER, SITE_RECORD
from bentwing.fleet.groups import MergeTask, merge_runs
from bentwing.fleet.scratch import scratch_folder
from bentwing.fleet.sending import fetch_for_merging, fetch_records, send_groups, send_run
from bentwing.fleet.store import Store
from bentwing.fleet.stored import Carried, renamed
from bentwing.fleet.task import Mapped, MapTask, map_recording_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bentwing.fleet.opened import Opened
    from bentwing.fleet.pool import Job, Pool
    from bentwing.fleet.process import Processes
    from bentwing.fleet.record import Site

_PATIENCE = 10.0  # s, for the first question


@dataclass(frozen=True, slots=True)
class Away:
    """Work whose results belong into a store.

    Attributes
    ----------
    url : of the site
    here : folder of its copy at the client, in which the task has its paths
    task : as it would be if the site were there
    """

    url: str
    here: Path
    task: Any


class Mirror:
    """The records of a site in a store, in a folder here.

    Parameters
    ----------
    folder : new one

    Raises
    ------
    InputError
        If the store does not answer, or holds something else there.
    """

    def __init__(self, url: str, folder: Path) -> None:
        self.url, self.folder = url.rstrip("/"), folder
        found = Store(self.url, _PATIENCE).files()
        self._store = Store(self.url)
        folder.mkdir()
        if SITE_RECORD in found:
            self._store.fetch(SITE_RECORD, found[SITE_RECORD], folder / SITE_RECORD)
        if found and SITE_FOLDER.read(folder) is None:
            msg = f"{url}: is not empty and holds no earlier site; choose another place"
            raise InputError(msg)
        # From now on the site is not complete, until `finish` makes it so.
        SITE_FOLDER.write(folder, {"kind": SITE_FOLDER.kind, "complete": False, "files": []})
        self._store.put(folder / SITE_RECORD, SITE_RECORD)
        fetch_records(self._store, found, folder)

    def opened(self, opened: Opened) -> Opened:
        """Return what opens a pool whose work sends its results to the store."""

        @contextmanager
        def away(megabytes: float, n_jobs: int) -> Iterator[Pool]:
            with opened(megabytes, n_jobs) as pool:
                yield _AwayPool(pool, self)

        return away

    def refresh(self, under: str) -> None:
        """Fetch the records of what was made meanwhile below a folder of the site."""
        fetch_records(self._store, self._store.files(under), self.folder)

    def finish(self, site: Site) -> Site:
        """Send the page, and the record of the site last; return the site with its places in the store."""
        for name in (PAGE, SITE_RECORD):
            self._store.put(self.folder / name, name)
        return site.in_store(self.url)


class _AwayPool:
    """Runs work whose results belong into a store."""

    def __init__(self, pool: Pool, mirror: Mirror) -> None:
        self._pool, self._mirror = pool, mirror

    def results(self, jobs: Sequence[Job]) -> Iterator[tuple[Job, Any]]:
        """Yield each job with its result; see `Pool`."""
        own = {job.key: job for job in jobs}
        for job, result in self._pool.results([self._away(job) for job in jobs]):
            if isinstance(result, Mapped) and result.folder is not None:
                self._mirror.refresh(result.folder.as_posix())
                yield own[job.key], replace(result, folder=self._mirror.folder / result.folder)
            else:
                if isinstance(job.task.task, MergeTask):
                    self._mirror.refresh(GROUPS)
                yield own[job.key], result

    def _away(self, job: Job) -> Job:
        task = job.task
        if isinstance(task, MapTask) and isinstance(task.payload, Path):
            task = replace(task, payload=Carried.of(task.payload))
        away = Away(self._mirror.url, self._mirror.folder, task)
        return replace(job, function=_FUNCTIONS[type(task)], task=away)


def map_away(away: Away, threads: int | None, processes: Processes | None = None) -> Mapped:
    """Map a recording and send the run to the store; see `map_recording_of`."""
    store, run = Store(away.url), f"{RECORDINGS}/{away.task.name}"
    with scratch_folder() as scratch:
        site = scratch / "site"
        task = replace(away.task, place=site / run)
        task.place.parent.mkdir(parents=True)
        try:
            # A worker that was given up may have done it, and could not say so.
            fetch_records(store, store.files(run), site)
            mapped = map_recording_of(task, threads, processes)
            if mapped.folder is not None and not mapped.is_earlier:
                send_run(store, site, run)
        except BentwingError as error:
            return Mapped(task.name, "refused", str(error), request=task.request)
    reason = mapped.reason.replace(str(site), store.url)
    return replace(mapped, reason=reason, folder=None if mapped.folder is None else Path(run))


def merge_away(
    away: Away, threads: int | None, processes: Processes | None = None
) -> dict[str, Any]:
    """Merge runs and send the maps to the store; see `merge_runs`."""
    store, here = Store(away.url), away.here
    with scratch_folder() as scratch:
        site = scratch / "site"
        runs = {n: folder.relative_to(here) for n, folder in away.task.runs.items()}
        task = replace(
            away.task,
            place=site / away.task.place.relative_to(here),
            kept=site / away.task.kept.relative_to(here),
            runs={name: site / run for name, run in runs.items()},
        )
        site.mkdir()
        try:
            found = store.files()
            fetch_for_merging(store, found, (run.as_posix() for run in runs.values()), site)
            answer = merge_runs(task, threads, processes)
            if "failed" not in answer:
                send_groups(store, found, site, answer)
        except InputError as error:
            answer = {"failed": str(error)}
    said: dict[str, Any] = renamed(answer, {str(site): store.url})
    return said


_FUNCTIONS: dict[type, Any] = {MapTask: map_away, MergeTask: merge_away}
