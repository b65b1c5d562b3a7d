# SPDX-License-Identifier: MIT OR Apache-2.0
"""The messages of a ROS 1 bag whose index rosbags has read.

rosbags makes a dictionary of every record's header and merges the topics by comparing index
entries one by one, which takes longer than all else that is done to a small message.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np
from rosbags.rosbag1.reader import decompressors

from bentwing.recording.containers.decompress import decompressed, require_chunk

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rosbags.interfaces import Connection
    from rosbags.rosbag1 import Reader

# The field of a record's header that tells its kind, with the length before it.
_IS_MESSAGE, _IS_CONNECTION = b"\4\0\0\0op=\2", b"\4\0\0\0op=\7"
_SIZE = struct.Struct("<I")
# rosbags keeps the function only, which sets no bounds.
_COMPRESSIONS = {function: name for name, function in decompressors.items()}


def bag_messages(
    reader: Reader, connections: Sequence[Connection], start_ns: int | None = None
) -> Iterator[tuple[Connection, int, bytes]]:
    """Yield connection, recorder's time and bytes in time order, those from a time on.

    Raises
    ------
    Exception
        Of many kinds, where the bag is damaged.
    """
    entries = [entry for connection in connections for entry in reader.indexes[connection.id]]
    owners = [connection for connection in connections for _ in reader.indexes[connection.id]]
    times = np.fromiter((entry.time for entry in entries), np.int64, len(entries))
    order = np.argsort(times, kind="stable")
    begin = 0 if start_ns is None else int(np.searchsorted(times[order], start_ns))
    position, chunk = -1, b""
    for i in order[begin:].tolist():
        stamp_ns, its_position, offset = entries[i]
        if its_position != position:
            position, chunk = its_position, _chunk(reader, its_position)
        yield owners[i], stamp_ns, _message(chunk, offset)


def _chunk(reader: Reader, position: int) -> bytes:
    """Return the decompressed records of the chunk at a position of the file."""
    size, start, decompress = reader.chunks[position]
    require_chunk(size)
    with reader.path.open("rb") as file:
        file.seek(start)
        data = file.read(size)
    if len(data) != size:
        msg = f"{len(data)} of {size} bytes of a chunk"
        raise ValueError(msg)
    return decompressed(_COMPRESSIONS[decompress], data)


def _message(chunk: bytes, offset: int) -> bytes:
    """Return the data of the message at an offset; its connection's record may come first."""
    while True:
        body = offset + 8 + _SIZE.unpack_from(chunk, offset)[0]
        (size,) = _SIZE.unpack_from(chunk, body - 4)
        if body + size > len(chunk):
            msg = f"a record of {size} bytes reaches beyond its chunk"
            raise ValueError(msg)
        header = chunk[offset + 4 : body - 4]
        if _IS_MESSAGE in header:
            return chunk[body : body + size]
        if _IS_CONNECTION not in header:
            msg = "a record in a chunk is neither a message nor a connection"
            raise ValueError(msg)
        offset = body + size
