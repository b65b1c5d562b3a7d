# SPDX-License-Identifier: MIT OR Apache-2.0
"""Read an MCAP file front to back: files cut off before their summary, and ROS 1 profiles.

Format: https://mcap.dev/spec. After the magic follow records: opcode (1 byte), length (uint64),
content. Chunks (6) hold schemas (3), channels (4) and messages (5).
"""

from __future__ import annotations

import struct
from array import array
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from rosbags.typesys.msg import normalize_msgtype

from bentwing.recording.containers.decompress import MOST_OF_CHUNK, decompressed, require_chunk
from bentwing.recording.containers.scanned import ScanEnd, ScannedMessage

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import BinaryIO

    from typing_extensions import Self

MAGIC = b"\x89MCAP0\r\n"
OP_FOOTER, OP_SCHEMA, OP_CHANNEL, OP_MESSAGE, OP_CHUNK, OP_DATA_END = 2, 3, 4, 5, 6, 15
_HEAD = 22  # bytes of a message before its data


@dataclass(slots=True)
class _Directory:
    """Schemas (name by id) and channels (topic, type, is CDR; by id) seen so far."""

    schemas: dict[int, str] = field(default_factory=dict)
    channels: dict[int, tuple[str, str, bool]] = field(default_factory=dict)

    def learn(self, operation: int, content: memoryview) -> None:
        """Enter what a record says, if it is of a schema or a channel."""
        if operation == OP_SCHEMA:
            (identity,) = struct.unpack_from("<H", content)
            self.schemas[identity] = _string(content, 2)[0]
        elif operation == OP_CHANNEL:
            identity, schema = struct.unpack_from("<HH", content)
            topic, position = _string(content, 4)
            encoding, _ = _string(content, position)
            kind = normalize_msgtype(self.schemas.get(schema, "unknown/msg/Unknown"))
            self.channels[identity] = (topic, kind, encoding == "cdr")


def scan_mcap(file: BinaryIO) -> Iterator[ScannedMessage | ScanEnd]:
    """Yield the messages of an open MCAP file, sorted in time within each chunk, then a ScanEnd."""
    if file.read(len(MAGIC)) != MAGIC:
        yield ScanEnd("not an MCAP file")
        return
    directory = _Directory()
    while True:
        try:
            operation, content, is_whole = _read_record(file)
            if operation in (OP_FOOTER, OP_DATA_END):
                yield ScanEnd(None)
                return
            found = _found(operation, content, directory, is_whole=is_whole)
        # A damaged chunk fails in its decompressor, which promises no particular exception.
        except Exception as error:
            if getattr(error, "errno", None) is not None:  # of the disk, not of what is on it
                raise
            yield ScanEnd(f"damaged before byte {file.tell()} ({error})")
            return
        yield from found.messages(directory)
        if not is_whole:
            yield ScanEnd(f"cut off at byte {file.tell()}")
            return


def _read_record(file: BinaryIO) -> tuple[int, memoryview, bool]:
    """Return opcode, content, and whether the content is all there."""
    head = file.read(9)
    if len(head) < 9:
        return OP_CHUNK, memoryview(b""), False
    (size,) = struct.unpack_from("<Q", head, 1)
    if not head[0]:  # no record has this kind, but the hole of a file is full of them
        msg = "a record of kind 0"
        raise ValueError(msg)
    if size > MOST_OF_CHUNK:
        msg = f"record of {size} bytes"
        raise ValueError(msg)
    content = file.read(size)
    return head[0], memoryview(content), len(content) == size


def _found(
    operation: int, content: memoryview, directory: _Directory, *, is_whole: bool
) -> _Messages:
    """Return the messages in a record, and enter what it says of schemas and channels."""
    if operation == OP_CHUNK:
        return _Messages.of(_records(content, is_whole=is_whole), directory)
    if operation == OP_MESSAGE and is_whole:
        found = _Messages(content)
        found.add(0, len(content), directory)
        return found
    if is_whole:
        directory.learn(operation, content)
    return _Messages(content)


def _records(content: memoryview, *, is_whole: bool) -> memoryview:
    """Return the records of a chunk; of one that is cut off, only uncompressed ones can be read."""
    if not is_whole:
        is_readable = len(content) >= 40 and not _string(content, 28)[0]
        return content[40:] if is_readable else content[:0]
    _, _, size, _ = struct.unpack_from("<QQQI", content)
    compression, position = _string(content, 28)
    packed = content[position + 8 :]
    if compression in {"", "none"}:  # not copied: it may be large
        require_chunk(max(size, len(packed)))
        return packed
    return memoryview(decompressed(compression, bytes(packed), size))


class _Messages:
    """Where the messages of a chunk are: it may be full of small ones, as objects ten times its size."""

    def __init__(self, records: memoryview) -> None:
        self._records = records
        self._stamps, self._begins, self._ends = array("Q"), array("Q"), array("Q")

    @classmethod
    def of(cls, records: memoryview, directory: _Directory) -> Self:
        found, position = cls(records), 0
        while position + 9 <= len(records):
            operation, size = struct.unpack_from("<BQ", records, position)
            begin = position + 9
            position = begin + size
            if position > len(records):
                break
            if operation == OP_MESSAGE:
                found.add(begin, position, directory)
            else:
                directory.learn(operation, records[begin:position])
        return found

    def add(self, begin: int, end: int, directory: _Directory) -> None:
        channel, _, stamp_ns, _ = struct.unpack_from("<HIQQ", self._records[begin:end])
        if channel not in directory.channels:
            msg = f"a message of channel {channel}, which is not described"
            raise ValueError(msg)
        self._stamps.append(stamp_ns)
        self._begins.append(begin)
        self._ends.append(end)

    def messages(self, directory: _Directory) -> Iterator[ScannedMessage]:
        """Yield them in time order."""
        stamps = np.frombuffer(self._stamps, np.uint64) if self._stamps else np.empty(0)
        for i in np.argsort(stamps, kind="stable"):
            content = self._records[self._begins[i] : self._ends[i]]
            topic, kind, cdr = directory.channels[struct.unpack_from("<H", content)[0]]
            yield ScannedMessage(topic, kind, self._stamps[i], bytes(content[_HEAD:]), cdr)


def _string(content: memoryview, position: int) -> tuple[str, int]:
    (size,) = struct.unpack_from("<I", content, position)
    end = position + 4 + size
    if end > len(content):
        msg = f"string of {size} bytes"
        raise ValueError(msg)
    return bytes(content[position + 4 : end]).decode(), end
