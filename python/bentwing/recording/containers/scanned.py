# SPDX-License-Identifier: MIT OR Apache-2.0
"""A recording read front to back because its index is missing or not understood."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from bentwing.base.errors import RecordingError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator
    from pathlib import Path
    from typing import BinaryIO


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """Topic of a recording; `type` in the ROS 2 spelling, e.g. sensor_msgs/msg/Imu."""

    name: str
    type: str
    count: int


class ScannedMessage(NamedTuple):
    """Message found by a scan; `type` in the ROS 2 spelling, `cdr` as in `Source`."""

    topic: str
    type: str
    stamp_ns: int
    data: bytes
    cdr: bool


class ScanEnd(NamedTuple):
    """Why a scan ended: `problem` is None at the regular end of the file."""

    problem: str | None


def first_bytes(path: Path, n: int) -> bytes:
    """Return the first bytes of a file, which tell what it is; fewer of a shorter one.

    Raises
    ------
    RecordingError
        If it cannot be opened.
    """
    try:
        with path.open("rb") as file:
            return file.read(n)
    except OSError as error:
        msg = f"{path}: cannot be opened ({error.strerror}); check the file's permissions"
        raise RecordingError(msg) from None


class ScannedSource:
    """Source over one file read sequentially; opening it costs one pass over the file.

    `scan` yields the messages of an open file, chunk by chunk in time order, and last a ScanEnd.
    """

    def __init__(
        self, path: Path, scan: Callable[[BinaryIO], Iterator[ScannedMessage | ScanEnd]]
    ) -> None:
        self._path, self._scan = path, scan
        self.warnings: list[str] = []
        self.start_ns, self.end_ns, self.cdr = 2**63 - 1, 0, False
        self.topics: tuple[TopicInfo, ...] = self._survey()

    def _survey(self) -> tuple[TopicInfo, ...]:
        counts: dict[tuple[str, str], int] = {}
        problem = None
        for item in self._items():
            if isinstance(item, ScanEnd):
                problem = item.problem
                continue
            counts[item.topic, item.type] = counts.get((item.topic, item.type), 0) + 1
            self.start_ns = min(self.start_ns, item.stamp_ns)
            self.end_ns = max(self.end_ns, item.stamp_ns + 1)
            self.cdr = item.cdr
        if problem is not None:
            seconds = max(0, self.end_ns - self.start_ns) / 1e9
            self.warnings.append(
                f"{self._path}: {problem}; {sum(counts.values())} messages of {seconds:.1f} s "
                "before that are used"
            )
        return tuple(TopicInfo(*key, count) for key, count in counts.items())

    def _items(self) -> Iterator[ScannedMessage | ScanEnd]:
        with self._path.open("rb") as file:
            yield from self._scan(file)

    def messages(
        self, topics: Collection[str], start_ns: int | None = None
    ) -> Iterator[tuple[str, int, bytes]]:
        """Yield (topic, recorder's time in ns, bytes) of the named topics in time order."""
        for item in self._items():
            if isinstance(item, ScanEnd) or item.topic not in topics:
                continue
            if start_ns is None or item.stamp_ns >= start_ns:
                yield item.topic, item.stamp_ns, item.data

    def close(self) -> None:
        """Nothing stays open between passes."""
