# SPDX-License-Identifier: MIT OR Apache-2.0
"""The list of recordings as a user writes it: YAML, or CSV from a spreadsheet."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, ValidationError, field_validator

from bentwing.base.errors import InputError
from bentwing.base.regular_file import require_regular, resolved
from bentwing.base.result_folder import is_plain_name
from bentwing.base.settings import Settings
from bentwing.base.units import Unit
from bentwing.base.validation import describe
from bentwing.base.yaml_files import read_yaml
from bentwing.fleet.entry import Entry
from bentwing.recording.ready import payload_path
from bentwing.run.settings import MOST_SECONDS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

MANIFEST_SUFFIXES = (".yaml", ".yml", ".csv")
_PARTS = ";"
_MOST_BYTES = 2**24  # a hundred thousand recordings
_LONGEST_NAME = 100  # characters; names of files have 255 bytes
_ADVICE = "give a list `recordings`, each with `recording` and, where known, name, payload, project, marks, start"


class Known(Settings):
    """What may be said of one recording, or of all of them."""

    payload: Path | None = Field(default=None, description="description of the sensor head")
    project: Path | None = Field(default=None, description="YAML file of what the report names")
    marks: Path | None = Field(default=None, description="CSV file of control points")

    @field_validator("payload")
    @classmethod
    def _comes_with_bentwing_or_not(cls, payload: Path | None) -> Path | None:
        return None if payload is None else payload_path(payload)


class Row(Known):
    """One recording."""

    name: str | None = Field(default=None, description="name of its run")
    recording: tuple[Path, ...] = Field(min_length=1, description="file or folder, or its parts")
    start: Annotated[float | None, Unit("s")] = Field(
        default=None, ge=0, le=MOST_SECONDS, description="time to skip"
    )

    @field_validator("recording", mode="before")
    @classmethod
    def _is_one_or_several(cls, value: object) -> object:
        return [value] if isinstance(value, str) else value

    @field_validator("name")
    @classmethod
    def _can_be_a_folder(cls, name: str) -> str:
        if not name or not is_plain_name(name) or name.startswith(".") or not name.isprintable():
            msg = f"{name!r} cannot be the name of a folder; give letters, digits, - and _"
            raise ValueError(msg)
        if len(name) > _LONGEST_NAME:
            msg = f"has {len(name)} characters; give at most {_LONGEST_NAME}"
            raise ValueError(msg)
        return name


class Manifest(Known):
    """All recordings, and what is the same for those that say nothing else."""

    recordings: tuple[Row, ...] = Field(min_length=1, description="the recordings")


def read_manifest(path: Path) -> list[Entry]:
    """Read the recordings that a file lists; its paths are relative to its folder.

    Raises
    ------
    InputError
        If it cannot be read, or a row cannot be meant; the sentence names the line or the key.
    """
    if path.suffix == ".csv":
        rows, places = _read_csv(path)
        manifest = Manifest(recordings=tuple(rows)) if rows else None
    else:
        manifest = _read_yaml(path)
        places = [f"recordings[{n}]" for n in range(len(manifest.recordings))]
    if manifest is None:
        msg = f"{path}: lists no recordings; give a row for each"
        raise InputError(msg)
    entries = [_entry(row, manifest, path.parent) for row in manifest.recordings]
    _require_distinct(path, entries, places)
    return entries


def _read_yaml(path: Path) -> Manifest:
    values = read_yaml(path, _ADVICE, InputError)
    if not isinstance(values, dict):
        msg = f"{path}: lists no recordings; {_ADVICE}"
        raise InputError(msg)
    try:
        return Manifest.model_validate(values)
    except ValidationError as error:
        raise InputError(describe(error, Manifest, path)) from None


def _read_csv(path: Path) -> tuple[list[Row], list[str]]:
    """Return the rows of a table and the lines where they stand."""
    rows, places = [], []
    for line, cells in _csv_rows(path):
        values: dict[str, Any] = {name: text for name, text in cells.items() if text}
        if "recording" in values:
            parts = [part.strip() for part in values["recording"].split(_PARTS)]
            values["recording"] = [part for part in parts if part]
        try:
            rows.append(Row.model_validate(values))
        except ValidationError as error:
            raise InputError(describe(error, Row, f"{path}, line {line}")) from None
        places.append(f"line {line}")
    return rows, places


def _csv_rows(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield line and cells by the names of their columns."""
    reader = csv.reader(io.StringIO(_text_of(path)), strict=True)
    names: list[str] = []
    try:
        for cells in reader:
            texts = [cell.strip() for cell in cells]
            if not any(texts):
                continue
            if not names:
                names = [text.lower() for text in texts]
                _require_columns(path, reader.line_num, names)
                continue
            if len(texts) > len(names):
                msg = (
                    f"{path}, line {reader.line_num}: has {len(texts)} cells below {len(names)} "
                    f"columns; put a text with a comma into quotes, and separate parts by {_PARTS}"
                )
                raise InputError(msg)
            yield reader.line_num, dict(zip(names, texts, strict=False))
    except csv.Error as error:
        msg = f"{path}, line {reader.line_num}: cannot be read as CSV ({error})"
        raise InputError(msg) from error


def _text_of(path: Path) -> str:
    try:
        require_regular(path, _MOST_BYTES)
        text = path.read_text(encoding="utf-8-sig")
        if "\0" not in text:
            return text
        msg = f"{path}: is no text, it holds NULs; save it as CSV in UTF-8"
    except FileNotFoundError:
        msg = f"{path}: no such file; give a manifest, or a folder of recordings"
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror}); give a CSV text file"
    except UnicodeDecodeError as error:
        msg = f"{path}: is no UTF-8 text ({error}); save it as CSV in UTF-8"
    raise InputError(msg)


def _require_columns(path: Path, line: int, names: Sequence[str]) -> None:
    known = list(Row.model_fields)
    bad = [name for name in names if name not in known or names.count(name) > 1]
    if bad or "recording" not in names:
        what = f"column {bad[0]!r} is twice or unknown" if bad else "has no column 'recording'"
        msg = f"{path}, line {line}: {what}; the first line names columns of {', '.join(known)}"
        raise InputError(msg)


def _entry(row: Row, manifest: Manifest, folder: Path) -> Entry:
    def known(name: str) -> Path | None:
        value = getattr(row, name) or getattr(manifest, name)
        return None if value is None else folder / value

    parts = tuple(folder / part for part in row.recording)
    name = row.name or resolved(parts[0]).stem
    return Entry(name, parts, known("payload"), known("project"), known("marks"), row.start)


def _require_distinct(path: Path, entries: Sequence[Entry], places: Sequence[str]) -> None:
    """Refuse names and recordings that are there twice."""
    seen: dict[object, str] = {}
    for entry, place in zip(entries, places, strict=True):
        files = tuple(resolved(part) for part in entry.parts if isinstance(part, Path))
        recording = (files, entry.start)
        for key, what in ((entry.name, f"the name {entry.name!r}"), (recording, "the recording")):
            if key in seen:
                msg = f"{path}, {place}: has {what} of {seen[key]}, too; give each once"
                raise InputError(msg)
            seen[key] = place
