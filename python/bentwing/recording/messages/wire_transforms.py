# SPDX-License-Identifier: MIT OR Apache-2.0
"""Read tf2_msgs/TFMessage straight from its bytes, as `wire` does with what a recording needs."""

from __future__ import annotations

import struct

from bentwing.base.clock import NS_PER_S
from bentwing.recording.link_chain import Link
from bentwing.recording.messages.wire import align, broken_if_malformed, byte_order, frame_name

LEAST_BYTES = 64  # of one transform: two lengths and seven float64


@broken_if_malformed
def stamped_transforms(raw: bytes, *, cdr: bool) -> list[tuple[int, Link]]:
    """Return the transforms of a message, each behind its stamp, ns."""
    order = byte_order(raw, cdr=cdr)
    position = 4 if cdr else 0
    (count,) = struct.unpack_from(f"{order}I", raw, position)
    if LEAST_BYTES * count > len(raw):
        msg = f"{count} transforms in {len(raw)} bytes"
        raise ValueError(msg)
    position += 4
    links: list[tuple[int, Link]] = []
    for _ in range(count):
        # stamp, and in ROS 1 a sequence number before it
        position = align(position, 4, cdr=cdr) + (0 if cdr else 4)
        seconds, nanoseconds = struct.unpack_from(f"{order}iI", raw, position)
        position += 8
        parent, position = _text(raw, position, order, cdr=cdr)
        child, position = _text(raw, position, order, cdr=cdr)
        position = align(position, 8, cdr=cdr)
        x, y, z, *quat = struct.unpack_from(f"{order}7d", raw, position)
        position += 56
        link = Link(parent, child, (x, y, z), (quat[0], quat[1], quat[2], quat[3]))
        links.append((seconds * NS_PER_S + nanoseconds, link))
    return links


def transforms(raw: bytes, *, cdr: bool) -> list[Link]:
    """Return the transforms of a message."""
    return [link for _, link in stamped_transforms(raw, cdr=cdr)]


def _text(raw: bytes, position: int, order: str, *, cdr: bool) -> tuple[str, int]:
    """Return the name of a frame and the position behind it."""
    position = align(position, 4, cdr=cdr)
    (size,) = struct.unpack_from(f"{order}I", raw, position)
    end = position + 4 + size
    if end > len(raw):
        msg = f"a name of {size} bytes"
        raise ValueError(msg)
    return frame_name(raw[position + 4 : end]), end
