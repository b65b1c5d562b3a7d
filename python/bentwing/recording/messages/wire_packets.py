# SPDX-License-Identifier: MIT OR Apache-2.0
"""Take a lidar's raw packets out of messages; arguments and errors as in `wire`."""

from __future__ import annotations

import struct
from typing import NamedTuple

from bentwing.recording.messages.wire import NS_PER_S, broken_if_malformed, header
from bentwing.recording.topics import HESAI_SCANS, OUSTER_PACKETS, RSLIDAR_PACKET, VELODYNE_SCAN

VELODYNE_SIZE = 1206


class Packet(NamedTuple):
    """One packet; `host_ns` is when the computer that recorded it had it."""

    host_ns: int
    data: bytes


def packets(kind: str, raw: bytes, recorder_ns: int, *, cdr: bool) -> list[Packet]:
    """Return the packets of a message of type `kind`; a datagram is one itself."""
    if kind == VELODYNE_SCAN:
        return _velodyne_scan(raw, recorder_ns, cdr=cdr)
    if kind in OUSTER_PACKETS:
        return [Packet(recorder_ns, _packet_msg(raw, cdr=cdr))]
    if kind in HESAI_SCANS:
        return _hesai_scan(raw, recorder_ns, cdr=cdr)
    if kind == RSLIDAR_PACKET:
        is_of_device, data = rslidar_packet(raw, cdr=cdr)
        return [] if is_of_device else [Packet(recorder_ns, data)]
    return [Packet(recorder_ns, raw)]


@broken_if_malformed
def string(raw: bytes, *, cdr: bool) -> str:
    """Return the text of a std_msgs/String."""
    text = _packet_msg(raw, cdr=cdr)
    return text.rstrip(b"\0").decode()


@broken_if_malformed
def _velodyne_scan(raw: bytes, recorder_ns: int, *, cdr: bool) -> list[Packet]:
    """Read a velodyne_msgs/VelodyneScan: per packet the driver's stamp and 1206 bytes."""
    _, position, order = header(raw, cdr=cdr)
    position += -position % 4 if cdr else 0
    (count,) = struct.unpack_from(f"{order}I", raw, position)
    position += 4
    step = 8 + VELODYNE_SIZE
    step += -step % 4 if cdr else 0
    # CDR pads between packets, not after the last one.
    if count and position + (count - 1) * step + 8 + VELODYNE_SIZE > len(raw):
        msg = f"{count} packets in {len(raw)} bytes"
        raise ValueError(msg)
    found = []
    for start in range(position, position + count * step, step):
        seconds, nanoseconds = struct.unpack_from(f"{order}iI", raw, start)
        stamp_ns = seconds * NS_PER_S + nanoseconds or recorder_ns
        found.append(Packet(stamp_ns, raw[start + 8 : start + 8 + VELODYNE_SIZE]))
    return found


@broken_if_malformed
def _packet_msg(raw: bytes, *, cdr: bool) -> bytes:
    """Read an ouster_ros/PacketMsg: uint8[]."""
    begin = 4 if cdr else 0
    order = ">" if cdr and raw[:2] == b"\0\0" else "<"
    (size,) = struct.unpack_from(f"{order}I", raw, begin)
    data = raw[begin + 4 : begin + 4 + size]
    if len(data) != size:
        msg = f"{len(data)} of {size} bytes"
        raise ValueError(msg)
    return data


@broken_if_malformed
def _hesai_scan(raw: bytes, recorder_ns: int, *, cdr: bool) -> list[Packet]:
    """Read a scan of Hesai's drivers: per packet the driver's stamp, uint8[] and how many of them count."""
    _, position, order = header(raw, cdr=cdr)
    position += -position % 4 if cdr else 0
    (count,) = struct.unpack_from(f"{order}I", raw, position)
    position += 4
    found = []
    for _ in range(count):
        position += -position % 4 if cdr else 0
        seconds, nanoseconds, n_bytes = struct.unpack_from(f"{order}iII", raw, position)
        begin = position + 12
        position = begin + n_bytes
        position += -position % 4 if cdr else 0
        (size,) = struct.unpack_from(f"{order}I", raw, position)
        position += 4
        if size > n_bytes:
            msg = f"a packet of {size} bytes in {n_bytes}"
            raise ValueError(msg)
        stamp_ns = seconds * NS_PER_S + nanoseconds or recorder_ns
        found.append(Packet(stamp_ns, raw[begin : begin + size]))
    return found


@broken_if_malformed
def rslidar_packet(raw: bytes, *, cdr: bool) -> tuple[bool, bytes]:
    """Read a rslidar_msg/RslidarPacket: whether it is about the device, and the packet."""
    _, position, order = header(raw, cdr=cdr)
    is_of_device = raw[position] != 0
    position += 2
    position += -position % 4 if cdr else 0
    (size,) = struct.unpack_from(f"{order}I", raw, position)
    data = raw[position + 4 : position + 4 + size]
    if len(data) != size:
        msg = f"{len(data)} of {size} bytes"
        raise ValueError(msg)
    return is_of_device, data
