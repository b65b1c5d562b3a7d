# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is to be done for one recording, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

from bentwing.base.errors import BentwingError, UsageError
from bentwing.base.provenance import bentwing_version
from bentwing.base.run_record import RUN_FOLDER, understood
from bentwing.fleet.folder import publish, require_run_or_nothing, staging_of
from bentwing.fleet.memory import megabytes_of
from bentwing.fleet.process import Processes, run_process
from bentwing.recording.sections.project import Project
from bentwing.run.choose import choose, given, merged
from bentwing.run.request import inputs_of, record_of_request, request_of
from bentwing.run.run import verdict_in

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from bentwing.evaluate.verdict import Verdict
    from bentwing.fleet.entry import Entry
    from bentwing.run.settings import RunSettings

State = Literal["good", "doubtful", "failed", "refused"]


@dataclass(frozen=True, slots=True)
class Choice:
    """Settings of all recordings, as `bentwing.run.choose.choose` takes them.

    Attributes
    ----------
    file : of settings
    assignments : as `window=4`
    payload : of the recordings that have none of their own
    options : nested settings
    """

    file: Path | None = None
    assignments: tuple[str, ...] = ()
    payload: Path | None = None
    options: Mapping[str, Any] = field(default_factory=dict)

    def settings(self, entry: Entry | None = None) -> RunSettings:
        """Return the settings of a recording, or of all that say nothing of their own; raises as `choose`."""
        options, payload = dict(self.options), self.payload
        if entry is not None:
            project = None if entry.project is None else Project.load(entry.project)
            options |= given(project=project, start=entry.start)
            if entry.marks is not None:
                options = merged(options, {"georeferencing": {"control_points": entry.marks}})
            payload = entry.payload or payload
        return choose(self.file, self.assignments, payload, options)


@dataclass(frozen=True, slots=True)
class MapTask:
    """A recording that is to be mapped into a folder.

    Attributes
    ----------
    name : of the recording
    place : of its run folder
    recordings : files that are one recording
    payload : file that the head was read from
    settings : YAML
    request : SHA-256 of inputs, settings and version
    megabytes : of memory that mapping it takes
    version : of bentwing, that this process has
    """

    name: str
    place: Path
    recordings: tuple[Path, ...]
    payload: Path | None
    settings: str
    request: str
    megabytes: float
    version: str = field(default_factory=bentwing_version)

    @property
    def key(self) -> str:
        """Name of the work, by its content."""
        return f"map-{self.name}-{self.request}"


@dataclass(frozen=True, slots=True)
class Mapped:
    """What came of a recording.

    Attributes
    ----------
    name : of the recording
    state : `good`, `doubtful` and `failed` by the verdict; `failed` also without a map; `refused` where
        it cannot be mapped as it is
    reason : why it is not good
    folder : its run folder, None where there is none
    request : SHA-256 of what was asked
    seconds : of recording
    points : in the map
    is_earlier : whether it was there already
    """

    name: str
    state: State
    reason: str = ""
    folder: Path | None = None
    request: str = ""
    seconds: float = 0.0
    points: int = 0
    is_earlier: bool = False

    @property
    def is_usable(self) -> bool:
        """Whether there is a map that is not wrong."""
        return self.state in {"good", "doubtful"}


def plan(
    entries: Sequence[Entry], runs: Path, choice: Choice
) -> tuple[list[MapTask], list[Mapped]]:
    """Return what is to be done, and what cannot be.

    Parameters
    ----------
    runs : folder of the run folders
    """
    tasks: list[MapTask] = []
    refused: list[Mapped] = []
    seen: dict[tuple[Any, ...], str] = {}
    for entry in entries:
        found = _task_of(entry, runs, choice, seen)
        if isinstance(found, Mapped):
            refused.append(found)
        else:
            tasks.append(found)
    return tasks, refused


def _task_of(
    entry: Entry, runs: Path, choice: Choice, seen: dict[tuple[Any, ...], str]
) -> MapTask | Mapped:
    """Return what is to be done for a recording, or that it is refused.

    Parameters
    ----------
    seen : names of recordings by their content; this one's is added
    """
    try:
        task, content = _described(entry, runs, choice)
    except OSError as error:
        reason = f"{error.filename or entry.parts[0]}: {error.strerror or error}"
        return Mapped(entry.name, "refused", reason)
    except BentwingError as error:
        return Mapped(entry.name, "refused", str(error))
    if content in seen:
        reason = f"{entry.parts[0]}: is the same recording as {seen[content]}; give each once"
        return Mapped(entry.name, "refused", reason)
    seen[content] = entry.name
    return task


def _described(entry: Entry, runs: Path, choice: Choice) -> tuple[MapTask, tuple[Any, ...]]:
    """Return what is to be done, and what tells the recording from others."""
    for part in entry.parts:
        part.stat()  # the system says what is wrong with it
    settings = choice.settings(entry)
    payload = entry.payload or choice.payload
    inputs = inputs_of([*entry.parts, *([payload] if payload else [])])
    read = inputs[:-1] if payload else inputs
    request = request_of(settings, inputs)
    size = sum(one["bytes"] for one in read)
    task = MapTask(
        entry.name, runs / entry.name, entry.parts, payload, settings.to_yaml(), request,
        megabytes_of(size, settings.closing),
    )  # fmt: skip
    return task, (*sorted(one["sha256"] for one in read), settings.start)


def finished(task: MapTask) -> Mapped | None:
    """Return what came of a recording if its run is there, made in the same way."""
    record = record_of_request(task.place, task.request, task.recordings)
    return None if record is None else replace(_mapped(task, record), is_earlier=True)


def map_recording_of(
    task: MapTask, threads: int | None, processes: Processes | None = None
) -> Mapped:
    """Map a recording in a process of its own, and give the run its name.

    Raises
    ------
    ProcessDiedError
        If it ended without an answer: it may be worth another try.
    """
    try:
        return finished(task) or _made(task, threads, processes)
    except BentwingError as error:
        return Mapped(task.name, "refused", str(error), request=task.request)


def _made(task: MapTask, threads: int | None, processes: Processes | None) -> Mapped:
    if task.version != bentwing_version():
        msg = f"this worker has bentwing {bentwing_version()}, the client has {task.version}; install the same"
        raise UsageError(msg)
    require_run_or_nothing(task.place)
    staging = staging_of(task.place, task.request)
    order = {
        "recordings": task.recordings, "payload": task.payload, "settings": task.settings,
        "threads": threads, "out": staging,
    }  # fmt: skip
    answer = run_process("map", order, task.name, processes)
    if RUN_FOLDER.read(staging) is not None:
        publish(staging, task.place)
    folder = task.place if RUN_FOLDER.read(task.place) is not None else None
    if "failed" in answer:
        return Mapped(task.name, "failed", answer["failed"], folder, task.request)
    if "refused" in answer:
        return Mapped(task.name, "refused", answer["refused"], folder, task.request)
    return _mapped(task, RUN_FOLDER.read(task.place) or {})


def _mapped(task: MapTask, record: Mapping[str, Any]) -> Mapped:
    with understood(task.place):
        verdict = verdict_in(record)
        return Mapped(
            task.name,
            verdict.state,
            reason_of(verdict),
            task.place,
            task.request,
            float(sum(last - first for first, last in record.get("segments") or [])),
            int((record.get("counts") or {}).get("map.written", 0)),
        )


def reason_of(verdict: Verdict) -> str:
    """Return why a result is not good, empty where it is."""
    return "" if verdict.state == "good" else verdict.sentence().partition(": ")[2]


def sentence_of(state: str, reason: str) -> str:
    """Return what is said of a result."""
    return f"{state}: {reason}" if reason else state
