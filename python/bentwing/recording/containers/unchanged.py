# SPDX-License-Identifier: MIT OR Apache-2.0
"""A recording is read several times; each time it must be the same, and its names can be shown."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bentwing.base.errors import RecordingError
from bentwing.base.printable import printable
from bentwing.base.provenance import files_of

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence
    from pathlib import Path

    from bentwing.recording.containers.interface import Source
    from bentwing.recording.containers.scanned import TopicInfo

    _State = dict[Path, tuple[int, int, int]]  # inode, size and time of change of each file

_AT_REST = "copy the recording to a disk where nothing changes it, and run this again"


class UnchangedSource:
    """A source whose files are the same, and yield as many messages, in every pass.

    Its topics and their types are printable: nothing else of it goes to a terminal as it stands.

    Raises
    ------
    RecordingError
        While messages are read: a file has changed, cannot be read any more, or ends earlier than in
        an earlier pass.
    """

    def __init__(self, source: Source, paths: Sequence[Path], before: _State) -> None:
        self._source, self._paths, self._before = source, paths, before
        self.topics, self.cdr = tuple(map(_shown, source.topics)), source.cdr
        shown = zip(self.topics, source.topics, strict=True)
        self._renamed = {own.name: given.name for own, given in shown if own.name != given.name}
        self.start_ns, self.end_ns = source.start_ns, source.end_ns
        self._most: dict[tuple[frozenset[str], int | None], int] = {}
        self._require_same()

    @property
    def warnings(self) -> list[str]:
        """Sentences about damage; grows while a damaged file is read."""
        return self._source.warnings

    def messages(
        self, topics: Collection[str], start_ns: int | None = None
    ) -> Iterator[tuple[str, int, bytes]]:
        """Yield (topic, recorder's time in ns, bytes) of the named topics in time order."""
        self._require_same()
        part, n = (frozenset(topics), start_ns), 0
        try:
            for topic, stamp_ns, data in self._messages(topics, start_ns):
                n += 1
                yield topic, stamp_ns, data
        except OSError as error:
            msg = (
                f"{self._paths[0]}: cannot be read any more ({error.strerror or error}), after {n} "
                f"messages; {_AT_REST}"
            )
            raise RecordingError(msg) from error
        finally:
            most = self._most.get(part, 0)
            self._most[part] = max(n, most)
        self._require_same()
        if n < most:
            msg = (
                f"{self._paths[0]}: {n} messages could be read where there were {most} in an earlier "
                f"pass; {_AT_REST}"
            )
            raise RecordingError(msg)

    def close(self) -> None:
        """Close the files."""
        self._source.close()

    def _messages(
        self, topics: Collection[str], start_ns: int | None
    ) -> Iterator[tuple[str, int, bytes]]:
        if not self._renamed:
            return self._source.messages(topics, start_ns)
        own = {self._renamed.get(topic, topic): topic for topic in topics}
        found = self._source.messages(own, start_ns)
        return ((own[topic], stamp_ns, data) for topic, stamp_ns, data in found)

    def _require_same(self) -> None:
        now = state_of(self._paths)
        changed = [path for path in self._before if now.get(path) != self._before[path]]
        if changed or len(now) != len(self._before):
            path = (changed or [*now])[0]
            what = "has changed" if path in now else "is gone or cannot be read any more,"
            msg = f"{path}: {what} while it was in use; {_AT_REST}"
            raise RecordingError(msg)


def _shown(topic: TopicInfo) -> TopicInfo:
    return replace(topic, name=printable(topic.name), type=printable(topic.type))


def state_of(paths: Sequence[Path]) -> _State:
    """Return what tells whether the files of a recording have changed."""
    state: _State = {}
    for file in (file for path in paths for file in files_of(path)):
        try:
            found = file.stat()
        except OSError:
            continue
        state[file] = (found.st_ino, found.st_size, found.st_mtime_ns)
    return state
