# SPDX-License-Identifier: MIT OR Apache-2.0
"""The merged maps of many runs: one for each group that has places in common."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.atomic import write_text
from bentwing.base.errors import BentwingError, InputError
from bentwing.base.run_record import RUN_FOLDER, finished_record
from bentwing.fleet.folder import COMPARISONS, GROUPS, clear_staging, publish, staging_of
from bentwing.fleet.process import Processes, run_unless_done
from bentwing.fleet.store import is_url
from bentwing.fleet.stored import Fetched, Stored
from bentwing.run.request import deciding, digest_of, record_of_request

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bentwing.fleet.task import Mapped
    from bentwing.run.settings import MergeSettings

ANSWER = "groups.json"


@dataclass(frozen=True, slots=True)
class Group:
    """Runs in one frame.

    Attributes
    ----------
    runs : names
    folder : of the merged map; of a run that belongs to no other, its own run folder
    state : of its verdict
    reason : why it is not good
    n_links : places that join the runs
    joins : which two runs have how many of them in common, and whether a loop of runs confirms these
    is_earlier : whether the map was there already
    """

    runs: tuple[str, ...]
    folder: Path
    state: str
    reason: str = ""
    n_links: int = 0
    is_earlier: bool = False
    joins: Sequence[Mapping[str, Any]] = ()


@dataclass(frozen=True, slots=True)
class MergeTask:
    """Runs that are to be merged.

    Attributes
    ----------
    place : folder of the groups' folders
    kept : folder of what comparing runs has found
    runs : run folders by name
    settings : JSON, what was given only
    request : SHA-256 of the runs' requests, settings and version
    megabytes : of memory that it takes
    """

    place: Path
    kept: Path
    runs: Mapping[str, Path]
    settings: str
    request: str
    megabytes: float

    @property
    def key(self) -> str:
        """Name of the work, by its content."""
        return f"merge-{self.request}"


def merge_task(
    site: Path, usable: Sequence[Mapped], settings: MergeSettings, megabytes: float
) -> MergeTask:
    """Return the merging of runs that can be used, in the order given, in the folder of a site."""
    runs = {one.name: one.folder for one in usable if one.folder is not None}
    asked = {
        "settings": deciding(settings),
        "runs": [(one.name, one.request) for one in usable],
    }
    # Unset values are filled in with what the runs agree on, so they must stay unset.
    described = settings.model_dump_json(exclude_unset=True)
    return MergeTask(
        site / GROUPS, site / COMPARISONS, runs, described, digest_of(asked), megabytes
    )


def merge_runs(
    task: MergeTask, threads: int | None, processes: Processes | None = None
) -> dict[str, Any]:
    """Merge runs in a process of its own, and give each group's map its name.

    Returns
    -------
    What `bentwing.fleet.grouping.merge_groups` says, or why there are no maps under `failed`.

    Raises
    ------
    ProcessDiedError
    """
    try:
        with Fetched() as fetched:
            return _merged(task, threads, processes, fetched)
    except InputError as error:  # of a store
        return {"failed": str(error)}


def _merged(
    task: MergeTask, threads: int | None, processes: Processes | None, fetched: Fetched
) -> dict[str, Any]:
    staging = staging_of(task.place, task.request)
    order = {
        "runs": task.runs, "settings": task.settings, "threads": threads, "out": staging,
        "made": _made(task.place), "kept": task.kept, "recordings": _fetch(task.runs, fetched),
    }  # fmt: skip
    answer = run_unless_done("merge", order, "merge", processes, lambda: finished_merging(task))
    answer = {name: fetched.named(value) for name, value in answer.items()}
    if "failed" in answer or "request" in answer:
        return answer
    task.place.mkdir(exist_ok=True)
    named = {group["folder"] for group in answer["groups"]} - {None}
    for old in task.place.iterdir():
        if old.name not in named and RUN_FOLDER.read(old) is not None:
            RUN_FOLDER.remove(old)
    for made in sorted(staging.iterdir()) if staging.is_dir() else []:
        if fetched.names:
            RUN_FOLDER.write(made, fetched.named(RUN_FOLDER.read(made)))
        publish(made, task.place / made.name)
    clear_staging(task.place)
    answer = {**answer, "request": task.request}
    write_text(task.place / ANSWER, json.dumps(answer, indent=1))
    return answer


def _fetch(runs: Mapping[str, Path], fetched: Fetched) -> dict[str, list[Path]]:
    """Fetch the recordings that are in a store; return where they are by the names of their runs."""
    found = {}
    for name, folder in runs.items():
        where = (RUN_FOLDER.read(folder) or {}).get("recordings") or []
        if any(map(is_url, where)):
            found[name] = [
                fetched.path(Stored.at(one) if is_url(one) else Path(one)) for one in where
            ]
    return found


def finished_merging(task: MergeTask) -> dict[str, Any] | None:
    """Return the answer of an earlier merging of the same runs whose maps are there."""
    try:
        answer = json.loads((task.place / ANSWER).read_text(encoding="utf-8"))
        if answer.get("request") != task.request:
            return None
        for group in answer["groups"]:
            if group["folder"] is not None:
                finished_record(task.place / group["folder"])
    except (OSError, ValueError, LookupError, AttributeError, TypeError, BentwingError):
        return None
    return {**answer, "groups": [{**group, "is_earlier": True} for group in answer["groups"]]}


def _made(place: Path) -> dict[str, str]:
    """Return the folders of complete groups by their requests."""
    found = {}
    for folder in sorted(place.iterdir()) if place.is_dir() else []:
        record = RUN_FOLDER.read(folder) or {}
        if record_of_request(folder, str(record.get("request")), None) is not None:
            found[record["request"]] = str(folder)
    return found
