# SPDX-License-Identifier: MIT OR Apache-2.0
"""The recordings in a folder and those below it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from bentwing.base.errors import BentwingError, RecordingError
from bentwing.base.regular_file import resolved
from bentwing.base.run_record import RECORD
from bentwing.fleet.entry import Entry
from bentwing.fleet.folder import SITE_RECORD
from bentwing.recording.containers.source import (
    EXPECTED,
    LVX2_SUFFIX,
    PCAP_SUFFIXES,
    is_folder_of_recordings,
)
from bentwing.recording.flights import flights_of
from bentwing.run.merging.source import distinct_names

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

PAYLOAD = "payload.yaml"
_SINGLE = (".bag", LVX2_SUFFIX, *PCAP_SUFFIXES)
# A file of this name says nothing that its folder does not.
_NAMELESS = "recording"


def find_recordings(paths: Sequence[Path]) -> list[Entry]:
    """Find the recordings in folders; other paths are recordings themselves.

    The payload of a recording is the payload.yaml beside it, or in the nearest folder above.

    Raises
    ------
    RecordingError
        If there are none.
    """
    found: list[tuple[str, tuple[Path, ...], Path | None]] = []
    for path in paths:
        if is_folder_of_recordings(path):
            inside = [
                (_name(parts[0], path), parts, _payload(parts[0], path)) for parts in _walk(path)
            ]
            if not inside:
                msg = f"{path}: a folder without recordings; {EXPECTED}, or a folder of these"
                raise RecordingError(msg)
            found += inside
        else:
            found.append((path.stem, (path,), None))
    names = distinct_names([name for name, _, _ in found])
    return [
        Entry(name, parts, payload) for name, (_, parts, payload) in zip(names, found, strict=True)
    ]


def _walk(top: Path) -> Iterator[tuple[Path, ...]]:
    """Yield the recordings below a folder, without the results of earlier runs."""
    seen: set[Path] = set()
    for folder, inside, files in os.walk(top, followlinks=True):
        here = Path(folder)
        is_result = RECORD in files or SITE_RECORD in files
        if is_result or resolved(here) in seen:  # links may run in a circle
            inside.clear()
            continue
        seen.add(resolved(here))
        recordings = [name for name in sorted(inside) if not is_folder_of_recordings(here / name)]
        inside[:] = sorted(n for n in {*inside} - {*recordings} if not n.startswith("."))
        yield from ((here / name,) for name in recordings)
        single = [here / n for n in sorted(files) if Path(n).suffix in _SINGLE and n[0] != "."]
        yield from _grouped(single)


def _grouped(files: list[Path]) -> list[tuple[Path, ...]]:
    """Put parts of one recording together; what cannot be read stays by itself."""
    if len(files) < 2:
        return [(file,) for file in files]
    readable = [file for file in files if _is_readable(file)]
    groups = [tuple(group) for group in flights_of(readable)] if readable else []
    return sorted([*groups, *((file,) for file in files if file not in readable)])


def _is_readable(file: Path) -> bool:
    try:
        return bool(flights_of([file]))
    except (BentwingError, OSError):
        return False


def _name(file: Path, top: Path) -> str:
    """Name a recording by its place in the folder, so that another one beside it does not rename it."""
    inner = file.relative_to(top)
    words = [*inner.parts[:-1], file.name if file.is_dir() else file.stem]
    if len(words) > 1 and words[-1] == _NAMELESS:
        words.pop()
    return "_".join(words)


def _payload(file: Path, top: Path) -> Path | None:
    inside = [file] if file.is_dir() else []
    for folder in (*inside, *file.parents):
        if (folder / PAYLOAD).is_file():
            return folder / PAYLOAD
        if folder == top:
            break
    return None
