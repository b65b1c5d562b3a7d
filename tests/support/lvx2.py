# SPDX-License-Identifier: MIT OR Apache-2.0
"""Files of Livox Viewer 2, written field by field as Livox's LVX2 Specifications v1.0 (2023.06) lists them."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

PER_PACKAGE = 96  # points of a Mid-360 and a HAP
PACKAGE_NS = 480_000  # of a Mid-360: 200 000 points a second


@dataclass(frozen=True)
class Device:
    """A lidar of a file."""

    serial: str = "47MDK1D0020101"
    number: int = 0x0A01A8C0
    kind: int = 9  # Mid-360


@dataclass(frozen=True)
class Package:
    """A package of points (x, y, z in units of its type, reflectivity, tag)."""

    stamp_ns: int
    points: Sequence[tuple[int, int, int, int, int]]
    device: Device = field(default_factory=Device)
    kind: int = 1  # of points: 1 in mm, 2 in cm

    def written(self) -> bytes:
        """The package with its header."""
        row = {1: "<iiiBB", 2: "<hhhBB"}.get(self.kind, "<iiiBB")
        points = b"".join(struct.pack(row, *point) for point in self.points)
        return b"".join(
            [
                struct.pack("<B", 0),  # version
                struct.pack("<I", self.device.number),
                struct.pack("<B", 0),  # LiDAR type, reserved
                struct.pack("<B", 1),  # time stamp type: PTP
                struct.pack("<Q", self.stamp_ns),
                struct.pack("<H", 0),  # counter of datagrams
                struct.pack("<B", self.kind),
                struct.pack("<I", len(points)),
                struct.pack("<B", 0),  # frame counter, reserved
                bytes(4),
                points,
            ]
        )


def write_lvx2(
    path: Path, frames: Sequence[Sequence[Package]], devices: Sequence[Device] = (Device(),)
) -> Path:
    """Write a file of frames, each with its packages."""
    head = [b"livox_tech".ljust(16, b"\0"), bytes([2, 0, 0, 0]), struct.pack("<I", 0xAC0EA767)]
    head.append(struct.pack("<IB", 50, len(devices)))
    for device in devices:
        serials = device.serial.encode().ljust(16, b"\0") + bytes(16)  # without a hub
        kinds = struct.pack("<IBBB", device.number, 0, device.kind, 1)
        head += [
            serials,
            kinds,
            struct.pack("<6f", 90.0, 0, 0, 1, 2, 3),
        ]  # a mounting, in degrees and m
    written = b"".join(head)
    for number, packages in enumerate(frames):
        body = b"".join(package.written() for package in packages)
        offsets = (len(written), len(written) + 24 + len(body), number)
        written += struct.pack("<3q", *offsets) + body
    path.write_bytes(written)
    return path
