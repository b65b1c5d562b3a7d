# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is to be done for one recording, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from bentwing.base.errors import BentwingError, UsageError
from bentwing.base.provenance import bentwing_version
from bentwing.base.regular_file import resolved
from bentwing.base.run_record import RUN_FOLDER, finished_record, understood
from bentwing.fleet.folder import publish, require_run_or_nothing, staging_of
from bentwing.fleet.process import Processes, run_unless_done
from bentwing.fleet.stored import Fetched
from bentwing.run.request import record_of_request, request_in
from bentwing.run.run import require_single, verdict_in

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bentwing.evaluate.verdict import Verdict
    from bentwing.fleet.stored import Carried, Stored

State = Literal["good", "doubtful", "failed", "refused"]


@dataclass(frozen=True, slots=True)
class MapTask:
    """A recording that is to be mapped into a folder.

    Attributes
    ----------
    name : of the recording
    place : of its run folder
    recordings : files that are one recording, here or in a store
    payload : file that the head was read from
    settings : YAML
    request : SHA-256 of inputs, settings and version
    megabytes : of memory that mapping it takes
    version : of bentwing, that this process has
    """

    name: str
    place: Path
    recordings: tuple[Path | Stored, ...]
    payload: Path | Carried | None
    settings: str
    request: str
    megabytes: float
    version: str = field(default_factory=bentwing_version)

    @property
    def key(self) -> str:
        """Name of the work, by its content."""
        return f"map-{self.name}-{self.request}"

    @property
    def where(self) -> list[str]:
        """Where the recordings lie, as run.json has it."""
        return [str(resolved(p) if isinstance(p, Path) else p) for p in self.recordings]


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


def finished(task: MapTask) -> Mapped | None:
    """Return what came of a recording if its run is there, made in the same way."""
    record = record_of_request(task.place, task.request, task.where)
    if record is None:
        return None
    return replace(_mapped(task.name, task.place, record), is_earlier=True)


def mapped_in(folder: Path, name: str) -> Mapped:
    """Return what is in the folder of a finished run, wherever and by whatever it was made.

    Raises
    ------
    UsageError, InputError
        If there is no complete run, or its files are others.
    """
    record = require_single(folder, finished_record(folder))
    return replace(_mapped(name, folder, record), is_earlier=True)


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
        with Fetched() as fetched:
            return _made(task, threads, processes, fetched)
    except BentwingError as error:
        return Mapped(task.name, "refused", str(error), request=task.request)


def _made(
    task: MapTask, threads: int | None, processes: Processes | None, fetched: Fetched
) -> Mapped:
    if task.version != bentwing_version():
        msg = f"this worker has bentwing {bentwing_version()}, the client has {task.version}; install the same"
        raise UsageError(msg)
    require_run_or_nothing(task.place)
    staging = staging_of(task.place, task.request)
    payload = None if task.payload is None else fetched.path(task.payload)
    order = {
        "recordings": [fetched.path(one) for one in task.recordings], "payload": payload,
        "settings": task.settings, "threads": threads, "out": staging,
    }  # fmt: skip
    answer = run_unless_done("map", order, task.name, processes, lambda: finished(task))
    if isinstance(answer, Mapped):
        return answer
    answer, folder = fetched.named(answer), None
    if (record := RUN_FOLDER.read(staging)) is not None:
        if fetched.names:
            # The run is of what was asked for, wherever it was while this was done.
            RUN_FOLDER.write(staging, {**fetched.named(record), "request": task.request})
        publish(staging, task.place)
        folder = task.place
    if "failed" in answer:
        return Mapped(task.name, "failed", answer["failed"], folder, task.request)
    if "refused" in answer:
        return Mapped(task.name, "refused", answer["refused"], folder, task.request)
    return _mapped(task.name, task.place, RUN_FOLDER.read(task.place) or {})


def _mapped(name: str, folder: Path, record: Mapping[str, Any]) -> Mapped:
    with understood(folder):
        verdict = verdict_in(record)
        return Mapped(
            name,
            verdict.state,
            reason_of(verdict),
            folder,
            request_in(record),
            float(sum(last - first for first, last in record.get("segments") or [])),
            int((record.get("counts") or {}).get("map.written", 0)),
        )


def reason_of(verdict: Verdict) -> str:
    """Return why a result is not good, empty where it is."""
    return "" if verdict.state == "good" else verdict.sentence().partition(": ")[2]


def sentence_of(state: str, reason: str) -> str:
    """Return what is said of a result."""
    return f"{state}: {reason}" if reason else state
