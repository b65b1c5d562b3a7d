# SPDX-License-Identifier: MIT OR Apache-2.0
"""Open recording files of any supported container and hand out raw messages in time order."""

from __future__ import annotations

import heapq
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from bentwing.base.errors import RecordingError
from bentwing.base.regular_file import is_there
from bentwing.recording.containers.bag_messages import bag_messages
from bentwing.recording.containers.bag_recovery import MAGIC, scan_bag
from bentwing.recording.containers.decompress import bound_rosbags
from bentwing.recording.containers.lvx2_scan import check_lvx2, scan_lvx2
from bentwing.recording.containers.mcap_scan import scan_mcap
from bentwing.recording.containers.pcap_scan import check_pcap, scan_pcap
from bentwing.recording.containers.scanned import ScannedSource, TopicInfo
from bentwing.recording.containers.unchanged import UnchangedSource, state_of

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from rosbags.interfaces import Connection
    from rosbags.rosbag1 import Reader as Rosbag1Reader
    from rosbags.rosbag2 import Reader as Rosbag2Reader

    from bentwing.recording.containers.interface import Source

    # Of some connections from a time on: connection, recorder's time and bytes.
    _Read = Callable[[Sequence[Connection], int | None], Iterator[tuple[Connection, int, bytes]]]

PCAP_SUFFIXES = (".pcap", ".pcapng")
LVX2_SUFFIX = ".lvx2"
SUFFIXES = (".bag", ".mcap", ".db3", LVX2_SUFFIX, *PCAP_SUFFIXES)
_METADATA = "metadata.yaml"
_MOST_OF_METADATA = 2**24  # bytes
EXPECTED = "give a ROS 1 .bag, a ROS 2 bag folder, a .db3, a .mcap, a .pcap or a .lvx2 file"


class RosbagsSource:
    """An intact file or folder, read through rosbags' index."""

    def __init__(self, path: Path) -> None:
        # A ROS 2 folder may well be called something.bag.
        self.cdr = path.is_dir() or path.suffix != ".bag"
        self._path = path
        self._reader: Rosbag1Reader | Rosbag2Reader
        self._read: _Read
        self._reader, self._read = _ros2_reader(path) if self.cdr else _ros1_reader(path)
        self._reader.open()
        infos = self._reader.topics
        self.topics = tuple(
            TopicInfo(name, info.msgtype or "", info.msgcount) for name, info in infos.items()
        )
        self.start_ns, self.end_ns = self._reader.start_time, self._reader.end_time
        self.warnings: list[str] = []

    def messages(
        self, topics: Collection[str], start_ns: int | None = None
    ) -> Iterator[tuple[str, int, bytes]]:
        """Yield (topic, recorder's time in ns, bytes) of the named topics in time order."""
        connections: list[Connection] = [
            connection for connection in self._reader.connections if connection.topic in topics
        ]
        if not connections:
            return
        stamp_ns = start_ns
        stream = self._read(connections, start_ns)
        while True:
            try:
                connection, stamp_ns, data = next(stream)
            except StopIteration:
                return
            except OSError as error:
                if error.errno is not None:  # of the disk; some decompressors raise their own
                    raise
                self._note_damage(stamp_ns, error)
                return
            # A damaged file makes the reader fail in many ways, none of which it promises.
            except Exception as error:
                self._note_damage(stamp_ns, error)
                return
            yield connection.topic, stamp_ns, data

    def _note_damage(self, stamp_ns: int | None, error: Exception) -> None:
        where = 0.0 if stamp_ns is None else (stamp_ns - self.start_ns) / 1e9
        self.warnings.append(
            f"{self._path}: damaged {where:.1f} s after its start ({error}); "
            "the messages up to there are used"
        )

    def close(self) -> None:
        """Close the files."""
        self._reader.close()


def _ros1_reader(path: Path) -> tuple[Rosbag1Reader, _Read]:
    from rosbags.rosbag1 import Reader

    _require_magic(path, MAGIC)
    reader = Reader(path)
    return reader, partial(bag_messages, reader)


def _ros2_reader(path: Path) -> tuple[Rosbag2Reader, _Read]:
    from rosbags.rosbag2 import Reader  # slow to import, and no ROS 1 bag needs it

    _require_described(path)
    bound_rosbags()
    reader = Reader(path)
    return reader, reader.messages


def _require_magic(path: Path, magic: bytes) -> None:
    """Refuse another kind of file, which rosbags would search to its end for a line."""
    with path.open("rb") as file:
        if file.read(len(magic)) != magic:
            msg = "it does not begin as such a file"
            raise ValueError(msg)


def _require_described(path: Path) -> None:
    described = path / _METADATA
    if described.is_file() and (size := described.stat().st_size) > _MOST_OF_METADATA:
        msg = f"metadata.yaml of {size} bytes"
        raise ValueError(msg)


class MergedSource:
    """Consecutive files of one recording."""

    def __init__(self, sources: Sequence[Source]) -> None:
        self._sources = sources
        # The datagrams of a capture are in neither encoding.
        encodings = {source.cdr for source in sources if any(map(_is_ros, source.topics))}
        self.cdr = True in encodings
        if len(encodings) > 1:
            msg = "the files mix ROS 1 and ROS 2 recordings: give the parts of one recording only"
            raise RecordingError(msg)
        self.start_ns = min(source.start_ns for source in sources)
        self.end_ns = max(source.end_ns for source in sources)
        totals: dict[tuple[str, str], int] = {}
        for topic in (topic for source in sources for topic in source.topics):
            key = (topic.name, topic.type)
            totals[key] = totals.get(key, 0) + topic.count
        self.topics = tuple(TopicInfo(*key, count) for key, count in totals.items())

    @property
    def warnings(self) -> list[str]:
        """Warnings of all the files."""
        return [warning for source in self._sources for warning in source.warnings]

    def messages(
        self, topics: Collection[str], start_ns: int | None = None
    ) -> Iterator[tuple[str, int, bytes]]:
        """Yield (topic, recorder's time in ns, bytes) of the named topics in time order."""
        streams = [source.messages(topics, start_ns) for source in self._sources]
        return heapq.merge(*streams, key=lambda message: message[1])

    def close(self) -> None:
        """Close the files."""
        for source in self._sources:
            source.close()


def _is_ros(topic: TopicInfo) -> bool:
    return "/msg/" in topic.type


def open_source(paths: Sequence[Path]) -> Source:
    """Open the files of one recording.

    Raises
    ------
    RecordingError
        A file does not exist, is no recording, or nothing in it can be read.
    """
    if not paths:
        msg = f"no recording given: {EXPECTED}"
        raise RecordingError(msg)
    before = state_of(paths)
    files = [file for path in paths for file in _files(Path(path))]
    sources: list[Source] = []
    try:
        sources.extend(map(_open_one, files))
        source = sources[0] if len(sources) == 1 else MergedSource(sources)
        return UnchangedSource(source, paths, before)
    except BaseException:
        for source in sources:
            source.close()
        raise


def _files(path: Path) -> list[Path]:
    """Return what to open for a path: itself, or the files of a folder without metadata."""
    if not is_there(path, RecordingError):
        msg = f"{path}: no such file or folder; {EXPECTED}"
        raise RecordingError(msg)
    if not path.is_dir() and not path.is_file():
        msg = f"{path}: is not a file; {EXPECTED}"
        raise RecordingError(msg)
    if not path.is_dir():
        return [path]
    if (path / _METADATA).exists():
        return [path]
    # The recorder writes it last, so a crash leaves a folder without one.
    files = _ros2_files(path)
    if not files:
        msg = f"{path}: a folder without metadata.yaml and without .mcap or .db3 files; {EXPECTED}"
        raise RecordingError(msg)
    return files


def is_folder_of_recordings(path: Path) -> bool:
    """Whether a path is a folder, and not one that is a recording itself."""
    return path.is_dir() and not (path / _METADATA).exists() and not _ros2_files(path)


def _ros2_files(folder: Path) -> list[Path]:
    return sorted(file for file in folder.iterdir() if file.suffix in (".mcap", ".db3"))


def _open_one(path: Path) -> Source:
    if not path.is_dir() and path.suffix not in SUFFIXES:
        msg = f"{path}: not a known kind of recording; {EXPECTED}"
        raise RecordingError(msg)
    if not path.is_dir() and path.suffix in PCAP_SUFFIXES:
        return _open_pcap(path)
    if not path.is_dir() and path.suffix == LVX2_SUFFIX:
        return _open_lvx2(path)
    try:
        return RosbagsSource(path)
    except PermissionError as error:
        msg = f"{path}: cannot be opened ({error.strerror}); check the file's permissions"
        raise RecordingError(msg) from None
    # Hostile and truncated files raise anything from struct.error to AssertionError.
    except Exception as error:
        return _scan_instead(path, str(error) or type(error).__name__)


def _open_pcap(path: Path) -> Source:
    check_pcap(path)
    source = ScannedSource(path, scan_pcap)
    if not source.topics:
        msg = f"{path}: a capture without a single frame; check that the lidar was sending"
        raise RecordingError(msg)
    return source


def _open_lvx2(path: Path) -> Source:
    check_lvx2(path)
    source = ScannedSource(path, scan_lvx2)
    if not source.topics:
        msg = f"{path}: a file of Livox Viewer 2 without a single point; check that the lidar was sending"
        raise RecordingError(msg)
    return source


def _scan_instead(path: Path, reason: str) -> Source:
    """Read without the index what the indexed reader refused: truncated or ROS 1 MCAP files."""
    scanners = {".bag": scan_bag, ".mcap": scan_mcap}
    if path.is_dir() or path.suffix not in scanners:
        msg = f"{path}: cannot be read ({reason}); record it again or repair it, e.g. with `ros2 bag reindex`"
        raise RecordingError(msg)
    source = ScannedSource(path, scanners[path.suffix])
    if not source.topics:
        source.close()
        detail = source.warnings[0] if source.warnings else f"{path}: {reason}"
        msg = f"{detail}; no message could be read: {EXPECTED}"
        raise RecordingError(msg)
    return source
