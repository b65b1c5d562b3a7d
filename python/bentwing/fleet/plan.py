# SPDX-License-Identifier: MIT OR Apache-2.0
"""From recordings and settings to what is to be done, and to what cannot be."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import BentwingError
from bentwing.fleet.memory import megabytes_of
from bentwing.fleet.stored import Carried, Stored
from bentwing.fleet.task import Mapped, MapTask
from bentwing.recording.sections.project import Project
from bentwing.run.choose import choose, given, merged
from bentwing.run.request import inputs_of, request_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from bentwing.fleet.entry import Entry
    from bentwing.run.settings import RunSettings


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
        settings = choose(self.file, self.assignments, payload, options)
        earth = settings.georeferencing
        if earth.control_points is None:
            return settings
        earth = earth.model_copy(update={"control_points": earth.control_points.absolute()})
        return settings.model_copy(update={"georeferencing": earth})


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
    settings = choice.settings(entry)
    # Whoever does the work may do it in another folder.
    recordings = tuple(p if isinstance(p, Stored) else p.absolute() for p in entry.parts)
    read = [one for part in recordings for one in _inputs_of(part)]
    known = entry.payload or choice.payload
    payload = None if known is None else known.absolute()
    request = request_of(settings, [*read, *inputs_of([payload] if payload else [])])
    size = sum(one["bytes"] for one in read)
    is_stored = any(isinstance(part, Stored) for part in recordings)
    task = MapTask(
        entry.name, runs / entry.name, recordings,
        Carried.of(payload) if payload and is_stored else payload,
        settings.to_yaml(), request, megabytes_of(size, settings.closing),
    )  # fmt: skip
    return task, (*sorted(one.get("sha256") or one["tag"] for one in read), settings.start)


def _inputs_of(part: Path | Stored) -> list[dict[str, Any]]:
    if isinstance(part, Stored):
        return part.inputs()
    part.stat()  # the system says what is wrong with it
    return inputs_of([part])
