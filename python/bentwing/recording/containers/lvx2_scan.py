# SPDX-License-Identifier: MIT OR Apache-2.0
"""Read an .lvx2 file of Livox Viewer 2 front to back, as the messages that Livox's ROS driver makes of its packets.

Layout: Livox, LVX2 Specifications v1.0 (2023.06). The topic of a lidar is `livox/` and its serial number.
The points are those of the lidar's own frame: the mounting that the file may state is not applied.
"""

from __future__ import annotations

import itertools
import struct
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bentwing.base.errors import RecordingError
from bentwing.recording.containers.scanned import ScanEnd, ScannedMessage, first_bytes
from bentwing.recording.messages.livox import CUSTOM_MSG, POINT, custom_message

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from typing import BinaryIO

    from numpy.typing import NDArray

SIGNATURE, MAGIC = b"livox_tech", 0xAC0EA767
_FILE = struct.Struct("<16s4BI")  # signature, version, magic
_CONTENTS = struct.Struct("<IB")  # ms of a frame, number of devices
_DEVICE = struct.Struct("<16s16sIBBB6f")  # serial, of its hub, id, _, kind, has mounting, mounting
_FRAME = struct.Struct("<3q")  # its place, the next one's, number
_PACKAGE = struct.Struct("<BIBBQHBIB4x")  # _, id, _, clock, ns, counter, kind, bytes, _
_POINTS = {
    1: (
        np.dtype([*((axis, "<i4") for axis in "xyz"), ("reflectivity", "u1"), ("tag", "u1")]),
        1e-3,
    ),
    2: (
        np.dtype([*((axis, "<i2") for axis in "xyz"), ("reflectivity", "u1"), ("tag", "u1")]),
        1e-2,
    ),
}  # and m per unit
_LINES = {9: 4, 10: 6}  # lasers of a Mid-360 and a HAP, that fire one after the other
MAX_FRAME = 1 << 27  # bytes; 50 ms of many lidars are a few megabytes
MAX_STAMP_NS = 2**31 * 10**9  # of ROS
MAX_SPAN_NS = 500_000_000  # of a message
MAX_PAUSE_NS = 10_000_000_000  # a longer one is a clock that was set
OTHER = "livox/other"


class _Device(NamedTuple):
    topic: str
    n_lines: int


class _Package(NamedTuple):
    """Points (n,) that a lidar measured one after the other from `stamp_ns` on; m per unit."""

    stamp_ns: int
    points: NDArray[np.void]
    unit: float


def check_lvx2(path: Path) -> None:
    """Refuse what is no file of Livox Viewer 2.

    Raises
    ------
    RecordingError
        With what it is instead, and what to do.
    """
    head = first_bytes(path, _FILE.size)
    if head[:10] != SIGNATURE or len(head) < _FILE.size:
        msg = (
            f"{path}: not a file of Livox Viewer 2 (it begins with {head[:10].hex() or 'nothing'}, not with "
            "'livox_tech'); give the .lvx2 file as the viewer saved it"
        )
        raise RecordingError(msg)
    _, major, *minor, magic = _FILE.unpack(head)
    if major != 2 or magic != MAGIC:
        version = ".".join(map(str, [major, *minor]))
        msg = (
            f"{path}: a Livox file of version {version}, but bentwing reads version 2 (.lvx2) only; record it with "
            "Livox Viewer 2, or make a bag of it with livox_ros_driver"
        )
        raise RecordingError(msg)


def scan_lvx2(file: BinaryIO) -> Iterator[ScannedMessage | ScanEnd]:
    """Yield a CustomMsg for each lidar of each frame of an open file, then a ScanEnd.

    The file has no clock of a recorder: that of the frames goes on where the lidar's clock is set.
    """
    file.seek(_FILE.size)
    devices = _devices(file)
    steps_ns: dict[int, float] = {}
    clock = _FrameClock()
    while True:
        at = file.tell()
        head = file.read(_FRAME.size)
        if not head:
            yield ScanEnd(None)
            return
        if len(head) < _FRAME.size:
            yield ScanEnd(f"cut off at byte {at}")
            return
        here, after, _ = _FRAME.unpack(head)
        size = after - here - _FRAME.size
        if here != at or not 0 <= size <= MAX_FRAME:
            yield ScanEnd(f"damaged at byte {at} (a frame from byte {here} to {after})")
            return
        body = file.read(size)
        if len(body) < size:
            yield ScanEnd(f"cut off at byte {at}, inside a frame")
            return
        by_lidar, n_other = _packages(body)
        stamps_ns = [packages[0].stamp_ns for packages in by_lidar.values()]
        frame_ns = clock.frame_ns(stamps_ns[0] if stamps_ns else None)
        for _ in range(n_other):
            yield ScannedMessage("other packages", OTHER, frame_ns, b"", cdr=True)
        for lidar, packages in by_lidar.items():
            steps_ns[lidar] = _step_ns(packages, steps_ns.get(lidar, 0.0))
            device = devices.get(lidar) or _Device(f"livox/{lidar:08x}", 1)
            for raw in _messages(packages, steps_ns[lidar], device.n_lines):
                yield ScannedMessage(device.topic, CUSTOM_MSG, frame_ns, raw, cdr=True)


def _devices(file: BinaryIO) -> dict[int, _Device]:
    found: dict[int, _Device] = {}
    contents = file.read(_CONTENTS.size).ljust(_CONTENTS.size, b"\0")
    for _ in range(_CONTENTS.unpack(contents)[1]):
        serial, _, lidar, _, kind, *_ = _DEVICE.unpack(
            file.read(_DEVICE.size).ljust(_DEVICE.size, b"\0")
        )
        name = serial.partition(b"\0")[0].decode("ascii", "replace").strip() or f"{lidar:08x}"
        found[lidar] = _Device(f"livox/{name}", _LINES.get(kind, 1))
    return found


class _FrameClock:
    """Time of frames, which goes on where the stamps of the lidar do not."""

    def __init__(self) -> None:
        self._last_ns: int | None = None
        self._offset_ns = 0

    def frame_ns(self, stamp_ns: int | None) -> int:
        """Return the time of the next frame, the stamp of its first package being known."""
        if self._last_ns is None or stamp_ns is None:
            self._last_ns = (self._last_ns or 0) if stamp_ns is None else stamp_ns
            return self._last_ns
        if not 0 <= stamp_ns + self._offset_ns - self._last_ns <= MAX_PAUSE_NS:
            self._offset_ns = self._last_ns + 50_000_000 - stamp_ns
        self._last_ns = stamp_ns + self._offset_ns
        return self._last_ns


def _packages(body: bytes) -> tuple[dict[int, list[_Package]], int]:
    """Return the packages of a frame by the lidar's id, and the number of those that have no points to read."""
    found: dict[int, list[_Package]] = {}
    n_other = at = 0
    while at + _PACKAGE.size <= len(body):
        _, lidar, _, _, stamp_ns, _, kind, size, _ = _PACKAGE.unpack_from(body, at)
        points = body[at + _PACKAGE.size : at + _PACKAGE.size + size]
        at += _PACKAGE.size + size
        dtype, unit = _POINTS.get(kind, (None, 0.0))
        if dtype is None or len(points) < size or size % dtype.itemsize or stamp_ns >= MAX_STAMP_NS:
            n_other += 1
        elif size:
            table = np.frombuffer(points, dtype)
            found.setdefault(lidar, []).append(_Package(stamp_ns, table, unit))
    return found, n_other


def _step_ns(packages: list[_Package], before: float) -> float:
    """Return the time from a point to the next: packages follow each other without a pause."""
    pairs = itertools.pairwise(packages)
    steps = [(b.stamp_ns - a.stamp_ns) / len(a.points) for a, b in pairs if b.stamp_ns > a.stamp_ns]
    return float(np.median(steps)) if steps else before


def _messages(packages: list[_Package], step_ns: float, n_lines: int) -> Iterator[bytes]:
    """Yield a message for each part of a frame whose stamps go on."""
    part: list[_Package] = []
    for package in packages:
        if part and not 0 <= package.stamp_ns - part[0].stamp_ns < MAX_SPAN_NS:
            yield _message(part, step_ns, n_lines)
            part = []
        part.append(package)
    if part:
        yield _message(part, step_ns, n_lines)


def _message(packages: list[_Package], step_ns: float, n_lines: int) -> bytes:
    base_ns = packages[0].stamp_ns
    table = np.zeros(sum(len(package.points) for package in packages), POINT)
    at = 0
    for package in packages:
        numbers = np.arange(len(package.points))
        rows = table[at : at + len(numbers)]
        rows["offset_time"] = package.stamp_ns - base_ns + np.rint(numbers * step_ns)
        for axis in "xyz":
            rows[axis] = package.points[axis] * package.unit
        rows["reflectivity"], rows["tag"] = package.points["reflectivity"], package.points["tag"]
        rows["line"] = numbers % n_lines
        at += len(numbers)
    return custom_message(base_ns, table)
