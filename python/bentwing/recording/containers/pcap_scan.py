# SPDX-License-Identifier: MIT OR Apache-2.0
"""Read a pcap capture of a lidar's packets front to back.

Format: https://www.tcpdump.org/manpages/pcap-savefile.5.html. The topic of a packet is the address
of its sender with the port it was sent to, e.g. 192.168.1.201:2368.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from bentwing.base.errors import RecordingError
from bentwing.recording.containers.datagrams import LINKS, DatagramReader, FrameProblemError
from bentwing.recording.containers.scanned import ScanEnd, ScannedMessage, first_bytes
from bentwing.recording.topics import (
    UDP_HESAI,
    UDP_OUSTER_IMU,
    UDP_OUSTER_LIDAR,
    UDP_ROBOSENSE,
    UDP_ROBOSENSE_DEVICE,
    UDP_VELODYNE,
)

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from typing import BinaryIO

    from bentwing.recording.containers.datagrams import Datagram

# Byte order and nanoseconds per unit of the stamps' fractions.
MAGICS = {
    b"\xd4\xc3\xb2\xa1": ("<", 1000),
    b"\xa1\xb2\xc3\xd4": (">", 1000),
    b"\x4d\x3c\xb2\xa1": ("<", 1),
    b"\xa1\xb2\x3c\x4d": (">", 1),
}
MAX_EMPTY = 1000  # frames without a byte behind each other; more are a hole in the file
PCAPNG = b"\x0a\x0d\x0d\x0a"
MAX_FRAME = 1 << 18  # bytes; the largest that tcpdump writes, more is damage
NOT_UDP, INCOMPLETE, OTHER = "other/not_udp", "udp/incomplete", "udp/other"
OUSTER_IMU_SIZE, OUSTER_IMU_PORT, OUSTER_LIDAR_PORT = 48, 7503, 7502
# 16 columns of 20 bytes and 12 for each of the 16, 32, 64 or 128 beams.
OUSTER_LEGACY_SIZES = (3392, 6464, 12608, 24896)
PANDAR40P_SIZES = (1262, 1266)
ROBOSENSE_SIZE = 1248
# The first bytes of RoboSense's packets: points of two formats, and the device.
ROBOSENSE = {
    b"\x55\xaa\x05\x0a": UDP_ROBOSENSE,
    b"\x55\xaa\x05\x5a": UDP_ROBOSENSE,
    b"\xa5\xff\x00\x5a": UDP_ROBOSENSE_DEVICE,
}


def check_pcap(path: Path) -> None:
    """Refuse what is no pcap capture.

    Raises
    ------
    RecordingError
        With what it is instead, and what to do.
    """
    head = first_bytes(path, 24)
    if head[:4] == PCAPNG:
        msg = (
            f"{path}: a capture in the pcapng format, but bentwing reads the older pcap only; "
            f"convert it with `editcap -F pcap {path.name} {path.stem}-old.pcap`"
        )
        raise RecordingError(msg)
    if len(head) < 24 or head[:4] not in MAGICS:
        msg = (
            f"{path}: not a pcap capture (it begins with {head[:4].hex() or 'nothing'}); give the "
            "file that tcpdump or Wireshark saved, in the format pcap"
        )
        raise RecordingError(msg)
    if (link := _link(head)) not in LINKS:
        msg = (
            f"{path}: a capture of link type {link}, which is neither Ethernet nor IP; capture the "
            "network interface that the lidar is connected to"
        )
        raise RecordingError(msg)


def scan_pcap(file: BinaryIO) -> Iterator[ScannedMessage | ScanEnd]:
    """Yield the datagrams of an open capture in its order, then a ScanEnd.

    What is no whole datagram comes out as an empty message of a type of its own, to be counted.
    """
    head = file.read(24)
    order, unit_ns = MAGICS[head[:4]]
    reader = DatagramReader(_link(head))
    n_empty = 0
    while True:
        record = file.read(16)
        if not record:
            yield ScanEnd(None)
            return
        if len(record) < 16:
            yield ScanEnd(f"cut off at byte {file.tell()}")
            return
        seconds, fraction, size, _ = struct.unpack(f"{order}4I", record)
        n_empty = 0 if size else n_empty + 1
        if size > MAX_FRAME or n_empty > MAX_EMPTY:
            yield ScanEnd(f"damaged at byte {file.tell() - 16} (a frame of {size} bytes)")
            return
        frame = file.read(size)
        if len(frame) < size:
            yield ScanEnd(f"cut off at byte {file.tell()}, inside a frame")
            return
        yield from _messages(reader, frame, seconds * 1_000_000_000 + fraction * unit_ns)


def _link(head: bytes) -> int:
    order, _ = MAGICS[head[:4]]
    (link,) = struct.unpack_from(f"{order}I", head, 20)
    return int(link) & 0xFFFF


def _messages(reader: DatagramReader, frame: bytes, stamp_ns: int) -> Iterator[ScannedMessage]:
    n_before = reader.n_incomplete
    try:
        datagram = reader.push(frame)
    except FrameProblemError:
        yield ScannedMessage("other frames", NOT_UDP, stamp_ns, b"", cdr=False)
        return
    for _ in range(reader.n_incomplete - n_before):
        yield ScannedMessage("incomplete datagrams", INCOMPLETE, stamp_ns, b"", cdr=False)
    if datagram is not None:
        topic = f"{datagram.source}:{datagram.port}"
        yield ScannedMessage(topic, _kind(datagram), stamp_ns, datagram.payload, cdr=False)


def _kind(datagram: Datagram) -> str:
    """Return whose packet a datagram is, by what the makers' formats have in common."""
    payload, size = datagram.payload, len(datagram.payload)
    if size == 1206 and payload[:2] == b"\xff\xee":
        return UDP_VELODYNE
    # Hesai's later formats have a version and zeros behind their first bytes.
    if payload[:2] == b"\xee\xff" or (size in PANDAR40P_SIZES and payload[:2] == b"\xff\xee"):
        return UDP_HESAI
    if size == ROBOSENSE_SIZE and payload[:4] in ROBOSENSE:
        return ROBOSENSE[payload[:4]]
    # Later formats begin with their type; heads, columns and beams add up to multiples of 64.
    is_later = payload[:2] == b"\1\0" and size > 1000 and size % 64 == 0
    if datagram.port == OUSTER_LIDAR_PORT or size in OUSTER_LEGACY_SIZES or is_later:
        return UDP_OUSTER_LIDAR
    if datagram.port == OUSTER_IMU_PORT or size == OUSTER_IMU_SIZE:
        return UDP_OUSTER_IMU
    return OTHER
