# SPDX-License-Identifier: MIT OR Apache-2.0
"""Read a ROS 1 bag front to back, for bags cut off before their index was written.

Format: http://wiki.ros.org/Bags/Format/2.0. A bag is a sequence of records, each a header of
`name=value` fields and data, both with a uint32 length. Chunks (op 5) hold connections (op 7) and
messages (op 2); everything else is index.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from rosbags.typesys.msg import normalize_msgtype

from bentwing.recording.containers.decompress import MOST_OF_CHUNK, decompressed
from bentwing.recording.containers.scanned import ScanEnd, ScannedMessage

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import BinaryIO

MAGIC = b"#ROSBAG V2.0\n"
OP_MESSAGE, OP_CHUNK, OP_CONNECTION = 2, 5, 7
MAX_HEADER = 1 << 20  # bytes; longer ones are damage, not headers

Fields = dict[bytes, bytes]
Connections = dict[bytes, tuple[str, str]]


class _CutError(Exception):
    """The file ends or is damaged inside a record."""


def scan_bag(file: BinaryIO) -> Iterator[ScannedMessage | ScanEnd]:
    """Yield the messages of an open bag, sorted in time within each chunk, then a ScanEnd."""
    if file.read(len(MAGIC)) != MAGIC:
        yield ScanEnd("not a ROS 1 bag of version 2.0")
        return
    connections: Connections = {}
    while True:
        try:
            header, data, is_whole = _read_record(file)
            messages = _messages_of(header, data, connections, is_whole=is_whole)
        except EOFError:
            # A bag that was closed ends in its index, which rosbags would have accepted.
            yield ScanEnd("has no complete index, recording or copying it was interrupted")
            return
        # A damaged chunk fails in its decompressor, with an error of its own per compression.
        except (_CutError, struct.error, KeyError, ValueError, OSError, RuntimeError) as error:
            if getattr(error, "errno", None) is not None:  # of the disk, not of what is on it
                raise
            yield ScanEnd(f"cut off or damaged at byte {file.tell()} ({error})")
            return
        yield from sorted(messages, key=lambda message: message.stamp_ns)
        if not is_whole:
            yield ScanEnd(f"cut off at byte {file.tell()}, inside a chunk")
            return


def _read_record(file: BinaryIO) -> tuple[Fields, bytes, bool]:
    """Return header, data, and whether the data are all there."""
    size = file.read(4)
    if not size:
        raise EOFError
    (n,) = struct.unpack("<I", size)
    if n > MAX_HEADER:
        msg = f"record header of {n} bytes"
        raise _CutError(msg)
    header = _fields(file.read(n))
    (n_data,) = struct.unpack("<I", file.read(4))
    if n_data > MOST_OF_CHUNK:
        msg = f"a record of {n_data} bytes"
        raise _CutError(msg)
    data = file.read(n_data)
    return header, data, len(data) == n_data


def _fields(raw: bytes) -> Fields:
    fields: Fields = {}
    position = 0
    while position < len(raw):
        (n,) = struct.unpack_from("<I", raw, position)
        name, separator, value = raw[position + 4 : position + 4 + n].partition(b"=")
        if not separator:
            msg = "record header without fields"
            raise _CutError(msg)
        fields[name] = value
        position += 4 + n
    return fields


def _messages_of(
    header: Fields, data: bytes, connections: Connections, *, is_whole: bool
) -> list[ScannedMessage]:
    operation = header[b"op"][0]
    if operation == OP_CONNECTION:
        _add_connection(header, data, connections)
    if operation == OP_MESSAGE:
        return [_message(header, data, connections)]
    if operation != OP_CHUNK:
        return []
    compression = header[b"compression"].decode()
    if not is_whole and compression != "none":
        msg = f"the last {compression} chunk is incomplete"
        raise _CutError(msg)
    return _messages_in_chunk(decompressed(compression, data), connections)


def _messages_in_chunk(chunk: bytes, connections: Connections) -> list[ScannedMessage]:
    """Return the complete messages of an uncompressed chunk, which may be cut off."""
    messages = []
    position = 0
    while position + 4 <= len(chunk):
        (n,) = struct.unpack_from("<I", chunk, position)
        body = position + 8 + n
        if body > len(chunk):
            break
        header = _fields(chunk[position + 4 : position + 4 + n])
        (n_data,) = struct.unpack_from("<I", chunk, body - 4)
        if body + n_data > len(chunk):
            break
        data = chunk[body : body + n_data]
        position = body + n_data
        if header[b"op"][0] == OP_CONNECTION:
            _add_connection(header, data, connections)
        elif header[b"op"][0] == OP_MESSAGE:
            messages.append(_message(header, data, connections))
    return messages


def _add_connection(header: Fields, data: bytes, connections: Connections) -> None:
    kind = normalize_msgtype(_fields(data)[b"type"].decode())
    connections[header[b"conn"]] = (header[b"topic"].decode(), kind)


def _message(header: Fields, data: bytes, connections: Connections) -> ScannedMessage:
    topic, kind = connections[header[b"conn"]]
    seconds, nanoseconds = struct.unpack("<II", header[b"time"])
    return ScannedMessage(topic, kind, seconds * 1_000_000_000 + nanoseconds, data, cdr=False)
