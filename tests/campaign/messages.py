# SPDX-License-Identifier: MIT OR Apache-2.0
"""A recording whose messages are wrong, in a container that is sound."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import random
    from pathlib import Path

_NUMBERS = (float("nan"), float("inf"), float("-inf"), 0.0, 1e30, -1e30, 1e-30, 1e308)
_DAY_NS = 86_400 * 10**9
FAULTS = (
    "numbers", "lost", "cut", "emptied", "repeated", "backwards", "day_later", "at_zero", "far_future",
    "noise", "one_left",
)  # fmt: skip


def rewritten(source: Path, target: Path, draw: random.Random) -> Path:
    """Write a ROS 1 bag again with one fault in many or few messages of one topic."""
    from rosbags.rosbag1 import Reader, Writer

    fault, share = draw.choice(FAULTS), draw.choice([0.001, 0.1, 1.0])
    begin = draw.choice([0.0, 0.0, 0.3])
    with Reader(source) as reader, Writer(target) as writer:
        known = {
            c.id: writer.add_connection(c.topic, c.msgtype, msgdef=c.msgdef.data, md5sum=c.digest)
            for c in reader.connections
        }
        topic = draw.choice(sorted({c.topic for c in reader.connections}))
        total = reader.message_count
        for n, (connection, stamp_ns, raw) in enumerate(reader.messages()):
            data = bytes(raw)
            is_hit = connection.topic == topic and n >= begin * total and draw.random() < share
            made = _changed(fault, stamp_ns, data, draw) if is_hit else [(stamp_ns, data)]
            for at_ns, content in made:
                writer.write(known[connection.id], at_ns, content)
    return target


def _changed(
    fault: str, stamp_ns: int, data: bytes, draw: random.Random
) -> list[tuple[int, bytes]]:
    if fault == "lost":
        return []
    if fault == "one_left":
        return [(stamp_ns, data)] if draw.random() < 0.01 else []
    if fault == "repeated":
        return [(stamp_ns, data)] * 3
    if fault == "cut":
        return [(stamp_ns, data[: draw.randrange(len(data))])]
    if fault == "emptied":
        return [(stamp_ns, b"")]
    if fault == "noise":
        return [(stamp_ns, draw.randbytes(len(data)))]
    if fault == "numbers":
        return [(stamp_ns, _with_number(data, draw))]
    moved = {
        "backwards": -draw.randrange(10**9),
        "day_later": _DAY_NS,
        "far_future": 2**61,
        "at_zero": -stamp_ns,
    }[fault]
    return [(stamp_ns, _stamped(data, max(0, stamp_ns + moved)))]


def _with_number(data: bytes, draw: random.Random) -> bytes:
    """A number, as a float or a double, somewhere behind the header."""
    form = draw.choice(["<f", "<d"])
    number = draw.choice(_NUMBERS)
    size = struct.calcsize(form)
    if form == "<f" and abs(number) > 3e38:
        number = float("inf")
    at = draw.randrange(20, max(21, len(data) - size))
    return data[:at] + struct.pack(form, number) + data[at + size :]


def _stamped(data: bytes, stamp_ns: int) -> bytes:
    """The message with another stamp in its header, which ROS 1 has behind a number of four bytes."""
    seconds, nanoseconds = divmod(stamp_ns, 10**9)
    return data[:4] + struct.pack("<II", seconds & 0xFFFFFFFF, nanoseconds) + data[12:]
