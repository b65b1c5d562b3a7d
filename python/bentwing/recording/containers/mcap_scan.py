# SPDX-License-Identifier: MIT OR Apache-2.0
"""Read an MCAP file front to back: files cut off before their summary, and ROS 1 profiles.

Format: https://mcap.dev/spec. After the magic follow records: opcode (1 byte), length (uint64),
content. Chunks (6) hold schemas (3), channels (4) and messages (5).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rosbags.typesys.msg import normalize_msgtype

from bentwing.recording.containers.decompress import MOST_OF_CHUNK, decompressed
from bentwing.recording.containers.scanned import ScanEnd, ScannedMessage

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import BinaryIO

MAGIC = b"\x89MCAP0\r\n"
OP_FOOTER, OP_SCHEMA, OP_CHANNEL, OP_MESSAGE, OP_CHUNK, OP_DATA_END = 2, 3, 4, 5, 6, 15


@dataclass(slots=True)
class _Directory:
    """Schemas (name by id) and channels (topic, type, is CDR; by id) seen so far."""

    schemas: dict[int, str] = field(default_factory=dict)
    channels: dict[int, tuple[str, str, bool]] = field(default_factory=dict)


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
            messages = _messages_of(operation, content, directory, is_whole=is_whole)
        # A damaged chunk fails in its decompressor, which promises no particular exception.
        except Exception as error:
            if getattr(error, "errno", None) is not None:  # of the disk, not of what is on it
                raise
            yield ScanEnd(f"damaged before byte {file.tell()} ({error})")
            return
        yield from sorted(messages, key=lambda message: message.stamp_ns)
        if not is_whole:
            yield ScanEnd(f"cut off at byte {file.tell()}")
            return


def _read_record(file: BinaryIO) -> tuple[int, bytes, bool]:
    """Return opcode, content, and whether the content is all there."""
    head = file.read(9)
    if len(head) < 9:
        return OP_CHUNK, b"", False
    (size,) = struct.unpack_from("<Q", head, 1)
    if size > MOST_OF_CHUNK:
        msg = f"record of {size} bytes"
        raise ValueError(msg)
    content = file.read(size)
    return head[0], content, len(content) == size


def _messages_of(
    operation: int, content: bytes, directory: _Directory, *, is_whole: bool = True
) -> list[ScannedMessage]:
    if not is_whole:
        return _messages_in_cut_chunk(operation, content, directory)
    if operation == OP_SCHEMA:
        (identity,) = struct.unpack_from("<H", content)
        directory.schemas[identity] = _string(content, 2)[0]
    elif operation == OP_CHANNEL:
        _add_channel(content, directory)
    elif operation == OP_MESSAGE:
        channel, _, stamp_ns, _ = struct.unpack_from("<HIQQ", content)
        topic, kind, cdr = directory.channels[channel]
        return [ScannedMessage(topic, kind, stamp_ns, content[22:], cdr)]
    elif operation == OP_CHUNK:
        return _messages_in_chunk(_decompressed(content), directory)
    return []


def _messages_in_cut_chunk(
    operation: int, content: bytes, directory: _Directory
) -> list[ScannedMessage]:
    """Return what is left of the last record: only uncompressed chunks can be read in part."""
    if operation != OP_CHUNK or len(content) < 40 or _string(content, 28)[0]:
        return []
    return _messages_in_chunk(content[40:], directory)


def _decompressed(content: bytes) -> bytes:
    _, _, size, _ = struct.unpack_from("<QQQI", content)
    compression, position = _string(content, 28)
    return decompressed(compression, content[position + 8 :], size)


def _messages_in_chunk(chunk: bytes, directory: _Directory) -> list[ScannedMessage]:
    messages: list[ScannedMessage] = []
    position = 0
    while position + 9 <= len(chunk):
        operation, size = struct.unpack_from("<BQ", chunk, position)
        if position + 9 + size > len(chunk):
            break
        content = chunk[position + 9 : position + 9 + size]
        messages += _messages_of(operation, content, directory)
        position += 9 + size
    return messages


def _add_channel(content: bytes, directory: _Directory) -> None:
    identity, schema = struct.unpack_from("<HH", content)
    topic, position = _string(content, 4)
    encoding, _ = _string(content, position)
    kind = normalize_msgtype(directory.schemas.get(schema, "unknown/msg/Unknown"))
    directory.channels[identity] = (topic, kind, encoding == "cdr")


def _string(content: bytes, position: int) -> tuple[str, int]:
    (size,) = struct.unpack_from("<I", content, position)
    end = position + 4 + size
    if end > len(content):
        msg = f"string of {size} bytes"
        raise ValueError(msg)
    return content[position + 4 : end].decode(), end
