# SPDX-License-Identifier: MIT OR Apache-2.0
"""Finished runs into a site: all those of a list, or those of a site and further ones."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import UsageError
from bentwing.base.regular_file import resolved
from bentwing.base.result_folder import ResultFolder
from bentwing.closing.global_registration import Budget
from bentwing.evaluate.verdict import Verdict
from bentwing.fleet.folder import PAGE, SITE_FOLDER
from bentwing.fleet.groups import Group, finished_merging, merge_runs, merge_task
from bentwing.fleet.memory import process_mb
from bentwing.fleet.opened import LazyPool
from bentwing.fleet.pool import Job
from bentwing.fleet.record import Site, usable_in
from bentwing.fleet.task import mapped_in, reason_of
from bentwing.report.site import write_site_page
from bentwing.run.check import require_coordinates
from bentwing.run.merging.on_earth import require_places
from bentwing.run.merging.source import distinct_names
from bentwing.run.settings import MergeSettings

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from bentwing.base.progress import Progress
    from bentwing.fleet.opened import Opened


def is_site(folder: Path) -> bool:
    """Whether there is the result of an earlier call of `bentwing fleet`."""
    return SITE_FOLDER.read(folder) is not None


def runs_of(paths: Sequence[Path]) -> list[Path]:
    """Return run folders, with those of sites in the place of these.

    Raises
    ------
    UsageError
        If a site has not been completed.
    """
    return [
        folder
        for path in paths
        for folder in (
            [one.folder for one in usable_in(_record(path), path)] if is_site(path) else [path]
        )
        if folder is not None
    ]


def join_site(
    paths: Sequence[Path],
    out: Path,
    given: Mapping[str, Any],
    opened: Opened,
    progress: Progress,
) -> Site:
    """Make the maps of a site from these runs and no others.

    Parameters
    ----------
    paths : run folders, and sites for all of their runs
    out : the site
    given : settings of the merging; the others are as before

    Raises
    ------
    UsageError, InputError
    """
    record = _record(out)
    settings = MergeSettings.model_validate({**(record.get("merging") or {}), **given})
    require_coordinates(settings.georeferencing)
    require_places(settings.georeferencing)
    known = {resolved(one.folder): one for one in usable_in(record, out) if one.folder is not None}
    folders = list(dict.fromkeys(resolved(path) for path in runs_of(paths)))
    folders.sort(key=lambda folder: folder not in known)  # those that are there keep their names
    if gone := [one.name for folder, one in known.items() if folder not in folders]:
        kept = f"to keep them, give {out} among the runs"
        progress.note(f"no longer in the site: {', '.join(gone)}; {kept}")
    names = distinct_names([known[f].name if f in known else f.name for f in folders])
    runs = [mapped_in(f, n) for f, n in zip(folders, names, strict=True)]
    # Until the new maps are made the site is what it was: who is interrupted can begin again.
    lock, _ = SITE_FOLDER.claim(out, folders)
    try:
        with ExitStack() as stack:
            site = merged_site(Site(out, runs), settings, LazyPool(opened, stack), progress)
    finally:
        lock.release()
    with ResultFolder(out, SITE_FOLDER, folders) as folder:
        complete(folder, site, [])
    return site


def merged_site(site: Site, settings: MergeSettings, pool: LazyPool, progress: Progress) -> Site:
    """Merge the runs of a site that can be used."""
    usable = [one for one in site.recordings if one.is_usable]
    alone = [Group((one.name,), one.folder or site.out, one.state, one.reason) for one in usable]
    site = replace(site, merging=settings.model_dump(mode="json", exclude_unset=True))
    if len(usable) < 2:
        return replace(site, groups=alone)
    budget = Budget.of(sum(one.seconds for one in usable), settings.loop_closure)
    task = merge_task(resolved(site.out), usable, settings, process_mb(budget.megabytes))
    answer = finished_merging(task)
    if answer is None:
        ((_, answer),) = pool.results([Job(task.key, merge_runs, task, task.megabytes)])
        if isinstance(answer, BaseException):
            answer = {"failed": str(answer) or type(answer).__name__}
        if "said" in answer:
            progress.note(answer["said"])
    if "failed" in answer:
        return replace(site, groups=alone, failure=answer["failed"])
    by_name = {group.runs[0]: group for group in alone}
    groups = [
        by_name[one["runs"][0]] if one["folder"] is None else _group(task.place, one)
        for one in answer["groups"]
    ]
    groups.sort(key=lambda group: len(group.runs) == 1)
    return replace(site, groups=groups, places=answer["places"])


def complete(folder: ResultFolder, site: Site, inputs: Iterable[Path]) -> None:
    """Write the page and the record of a site, last of all."""
    record = site.to_json()
    write_site_page(folder.file(PAGE), record)
    folder.complete(inputs, record)


def _record(out: Path) -> dict[str, Any]:
    record = SITE_FOLDER.read(out) or {}
    if not record.get("complete"):
        msg = f"{out}: the site is not complete; finish it with `bentwing fleet` first"
        raise UsageError(msg)
    return record


def _group(place: Path, answer: Mapping[str, Any]) -> Group:
    verdict = Verdict.from_json(answer["verdict"])
    return Group(
        tuple(answer["runs"]),
        place / answer["folder"],
        verdict.state,
        reason_of(verdict),
        answer["n_links"],
        answer["is_earlier"],
        answer.get("joins") or [],
    )
