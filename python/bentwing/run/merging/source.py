# SPDX-License-Identifier: MIT OR Apache-2.0
"""Runs as they lie on the disk: trajectory, calibration, and the recording to read points from."""

from __future__ import annotations

from collections import Counter
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from bentwing.base.errors import InputError, UsageError
from bentwing.base.progress import as_progress
from bentwing.base.provenance import describe_input, files_of
from bentwing.base.regular_file import resolved
from bentwing.base.run_record import finished_record, understood
from bentwing.closing.georeference.settings import GeoreferenceSettings
from bentwing.map.project import project
from bentwing.recording import Payload, Recording
from bentwing.recording.preprocess import RecordingPart
from bentwing.recording.sections.project import project_in
from bentwing.run.mapping import MapSource
from bentwing.run.run import estimate_of, require_single, verdict_in

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from bentwing.base.estimate import Estimate
    from bentwing.base.progress import Progress
    from bentwing.evaluate.verdict import Reason, Verdict
    from bentwing.map.chunk import MapChunk
    from bentwing.recording.sections.project import Project


@dataclass(frozen=True, slots=True)
class Source:
    """A run that is to be merged.

    Attributes
    ----------
    name : tells it from the others
    folder : of the run
    recordings : files that are one recording
    start, duration : s, the part of the recording that was used; None for all of it
    force : whether the run mapped the recording although it is unfit
    georeferencing : how the run used GNSS fixes and control points
    project : what its report names
    start_ns : time zero of the recording, ns UTC
    inputs : what run.json says about the files
    warnings, verdict : of the run
    """

    name: str
    folder: Path
    recordings: list[Path]
    start: float | None
    duration: float | None
    start_ns: int
    payload: Payload
    force: bool
    georeferencing: GeoreferenceSettings
    project: Project | None
    estimate: Estimate
    inputs: list[dict[str, Any]]
    warnings: list[str]
    verdict: Verdict

    @property
    def reasons(self) -> list[Reason]:
        """What speaks against the run, as a merged map repeats it."""
        return [replace(r, sentence=f"{self.name}: {r.sentence}") for r in self.verdict.reasons]

    @property
    def told(self) -> list[str]:
        """Warnings of the run, as a merged map repeats them."""
        return [f"{self.name}: {warning}" for warning in self.warnings]

    def points(
        self, estimate: Estimate, *, threads: int | None, progress: Progress | None = None
    ) -> MapSource:
        """Return the run whose points can be read, with or without a bar that shows how far that is.

        Parameters
        ----------
        estimate : of the run, in the frame of the map
        """

        def chunks(counts: dict[str, int]) -> Iterator[MapChunk]:
            dropped = Counter[str]()
            with (
                self.part() as part,
                as_progress(progress).stage(f"map {self.name}", part.length) as shown,
            ):
                yield from project(
                    part.batches(shown, dropped),
                    estimate.trajectory,
                    estimate.calibration,
                    segments=estimate.segments,
                    threads=threads,
                    counts=counts,
                )
                counts.update(part.recording.counts + dropped)

        return MapSource(estimate, self.start_ns, chunks)

    def carrying(self, attributes: tuple[str, ...] | None) -> Source:
        """Return the run with these further fields of the lidar's points; None for its own."""
        if attributes is None:
            return self
        return replace(self, payload=self.payload.carrying(attributes))

    @contextmanager
    def part(self) -> Iterator[RecordingPart]:
        """Open the part of the recording that the run used."""
        with Recording(self.recordings, self.payload, strict=not self.force) as recording:
            yield RecordingPart(recording, self.payload, self.start, self.duration)


def open_sources(
    folders: Sequence[Path], moved: Mapping[Path, list[Path]] = MappingProxyType({})
) -> list[Source]:
    """Read the runs in folders.

    Parameters
    ----------
    moved : where the recordings of some runs are now

    Raises
    ------
    UsageError
        If there are fewer than two, one is given twice, or one is no complete run.
    InputError
        If a recording is gone or has changed, or a trajectory cannot be read.
    """
    if len(folders) < 2:
        msg = (
            f"{len(folders)} run given: merging takes two or more; bentwing merge RUN RUN... -o OUT"
        )
        raise UsageError(msg)
    seen: dict[Path, Path] = {}
    for folder in folders:
        place = resolved(folder)
        if place in seen:
            msg = f"{folder}: is the same run as {seen[place]}; give each run once"
            raise UsageError(msg)
        seen[place] = folder
    names = distinct_names([resolved(folder).name for folder in folders])
    sources = [open_source(f, n, moved.get(f)) for f, n in zip(folders, names, strict=True)]
    _refuse_same_recording(sources)
    return sources


def distinct_names(names: Sequence[str]) -> list[str]:
    """Return names of which no two are the same: later ones get a number."""
    found: list[str] = []
    for name in names:
        wanted, number = name or "run", 2
        while wanted in found:
            wanted, number = f"{name}_{number}", number + 1
        found.append(wanted)
    return found


def open_source(folder: Path, name: str, moved: list[Path] | None = None) -> Source:
    """Read the run in a folder; see `open_sources`."""
    record = require_single(folder, finished_record(folder))
    if not record.get("recordings") or record.get("start_ns") is None:
        msg = (
            f"{folder}: run.json does not name the recording, as those of earlier versions; map it "
            "again"
        )
        raise UsageError(msg)
    with understood(folder):
        return _source(folder, name, record, moved)


def _source(folder: Path, name: str, record: dict[str, Any], moved: list[Path] | None) -> Source:
    recordings = moved or [Path(path) for path in record["recordings"]]
    _require_unchanged(folder, recordings, record["inputs"])
    settings = record["settings"]
    return Source(
        name,
        folder,
        recordings,
        settings.get("start"),
        settings.get("duration"),
        int(record["start_ns"]),
        _payload(folder, settings),
        bool(settings.get("force")),
        GeoreferenceSettings.model_validate(settings.get("georeferencing") or {}),
        project_in(record),
        estimate_of(folder, record),
        record["inputs"],
        list(record.get("warnings") or []),
        verdict_in(record),
    )


def _payload(folder: Path, settings: dict[str, Any]) -> Payload:
    try:
        return Payload.model_validate(settings["payload"])
    except (KeyError, ValidationError) as error:
        msg = (
            f"{folder}: run.json describes no sensor head that can be used ({error}); map it again"
        )
        raise InputError(msg) from error


def _require_unchanged(
    folder: Path, recordings: Sequence[Path], inputs: Sequence[dict[str, Any]]
) -> None:
    gone = [path for path in recordings if not path.exists()]
    if gone:
        msg = (
            f"{folder}: its recording {gone[0]} is gone, and its points have to be read again; "
            "put it back there, or map it again from where it is now"
        )
        raise InputError(msg)
    known = {(i["name"], i["bytes"], i["sha256"]) for i in inputs}
    for path in recordings:
        for file in files_of(path):
            now = describe_input(file)
            if (now["name"], now["bytes"], now["sha256"]) not in known:
                msg = (
                    f"{file}: is not the recording that {folder} was made of (its size or SHA-256 "
                    "differs); map it again, or put the old one back"
                )
                raise InputError(msg)


def _refuse_same_recording(sources: Sequence[Source]) -> None:
    """Refuse runs of the same part of a recording: they would confirm each other's errors."""
    seen: dict[tuple[Any, ...], Source] = {}
    for source in sources:
        own = {path.name for path in source.recordings}
        hashes = [i["sha256"] for i in source.inputs if i["name"] in own] or [
            i["sha256"] for i in source.inputs
        ]
        key = (*sorted(hashes), source.start, source.duration)
        if key in seen:
            msg = (
                f"{source.folder}: is a run of the same recording as {seen[key].folder}; "
                "give each recording once"
            )
            raise UsageError(msg)
        seen[key] = source
