# SPDX-License-Identifier: MIT OR Apache-2.0
"""Messages of an intact ROS 1 bag, compared with what rosbags itself reads."""

from __future__ import annotations

import numpy as np
import pytest
from rosbags.rosbag1 import Reader, Writer

from bentwing.recording.containers.bag_messages import bag_messages

TYPE = "std_msgs/msg/String"
COMPRESSIONS = [None, Writer.CompressionFormat.BZ2, Writer.CompressionFormat.LZ4]


def bag(path, compression=None):
    """Three topics in chunks of half a megabyte, out of order and with equal times."""
    rng = np.random.default_rng(0)
    writer = Writer(path)
    writer.chunk_threshold = 1 << 19
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        connections = [
            writer.add_connection(f"/{name}", TYPE, msgdef="string data", md5sum="0" * 32)
            for name in "abc"
        ]
        for i in range(2000):
            stamp_ns = 10**9 + 1000 * (i + int(rng.integers(-5, 5)))
            writer.write(connections[rng.integers(3)], stamp_ns, rng.bytes(int(rng.integers(2000))))
    return path


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("start_ns", [None, 0, 10**9 + 1_000_000, 10**10])
def test_messages_are_those_of_rosbags_in_the_same_order(tmp_path, compression, start_ns):
    with Reader(bag(tmp_path / "a.bag", compression)) as reader:
        assert len(reader.chunks) > 1
        for chosen in (reader.connections, reader.connections[1:]):
            expected = list(reader.messages(chosen, start_ns))
            assert list(bag_messages(reader, chosen, start_ns)) == expected


def test_a_damaged_record_is_no_message(tmp_path):
    path = bag(tmp_path / "a.bag")
    with Reader(path) as reader:
        first = min(chunk.datapos for chunk in reader.chunks.values())
    raw = bytearray(path.read_bytes())
    for value in (0x00, 0x7F, 0xFF):
        raw[first : first + 200_000] = bytes([value]) * 200_000
        path.write_bytes(raw)
        with Reader(path) as reader, pytest.raises(Exception, match=r"."):
            list(bag_messages(reader, reader.connections))
