# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which files are consecutive or simultaneous parts of one recording, and which are flights of their own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bentwing.base.clock import NS_PER_S
from bentwing.recording.containers.source import open_source

if TYPE_CHECKING:
    from collections.abc import Sequence

# A recorder that begins another file pauses no longer than this, s.
PAUSE = 10.0
# Files that follow each other may overlap by messages that came late, s.
OVERLAP = 1.0


@dataclass(frozen=True, slots=True)
class _File:
    path: Path
    start_ns: int
    end_ns: int
    topics: frozenset[str]


def flights_of(paths: Sequence[Path | str]) -> list[list[Path]]:
    """Group files by the recording that they are of.

    Files belong together where one begins when the other has ended, or where they were recorded at the
    same time and have different topics, as those of two computers.

    Returns
    -------
    The recordings in the order of their first files, with their files in order of time.

    Raises
    ------
    RecordingError
        If a file cannot be read.
    """
    listed = [Path(path) for path in paths]
    files = sorted((_described(path) for path in listed), key=lambda file: file.start_ns)
    groups: list[list[_File]] = []
    for file in files:
        # What was recorded last is continued first.
        for group in reversed(groups):
            if _belongs(file, group):
                group.append(file)
                break
        else:
            groups.append([file])
    found = [[file.path for file in group] for group in groups]
    return sorted(found, key=lambda group: min(listed.index(path) for path in group))


def _described(path: Path) -> _File:
    source = open_source([path])
    try:
        topics = frozenset(topic.name for topic in source.topics)
        return _File(path, source.start_ns, source.end_ns, topics)
    finally:
        source.close()


def _belongs(file: _File, group: Sequence[_File]) -> bool:
    end = max(other.end_ns for other in group)
    pause = (file.start_ns - end) / NS_PER_S
    if -OVERLAP < pause <= PAUSE:
        return True
    return pause <= -OVERLAP and not any(
        file.topics & other.topics for other in group if other.end_ns > file.start_ns
    )
