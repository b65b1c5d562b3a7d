# SPDX-License-Identifier: MIT OR Apache-2.0
"""Read the few message types a recording needs straight from their bytes.

A scan of 400 beams takes a generic deserializer many times as long as these views on the bytes,
and a recording has tens of thousands of them. It also makes message definitions unnecessary: these
types have not changed since ROS 1. Every function takes `(raw, cdr)`, `cdr` telling ROS 2's
encoding (CDR, aligned) from ROS 1's (packed), and raises `BrokenMessageError` for bytes that are no such
message.
"""

from __future__ import annotations

import functools
import struct
from typing import TYPE_CHECKING, NamedTuple, ParamSpec, TypeVar

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

P = ParamSpec("P")
R = TypeVar("R")

NS_PER_S = 1_000_000_000
CDR_BIG_ENDIAN, CDR_LITTLE_ENDIAN = b"\x00\x00", b"\x00\x01"
MAX_POINT_FIELDS = 64


class BrokenMessageError(ValueError):
    """The bytes are not a message of the expected type."""


class RawScan(NamedTuple):
    """LaserScan, or the first valid echo of a MultiEchoLaserScan; ranges (B,) float32."""

    stamp_ns: int
    angle_min: float
    angle_increment: float
    time_increment: float
    scan_time: float
    range_min: float
    range_max: float
    ranges: NDArray[np.float32]
    intensities: NDArray[np.float32] | None


class RawField(NamedTuple):
    """Field of a PointCloud2."""

    name: str
    offset: int
    datatype: int
    n_values: int


class RawCloud(NamedTuple):
    """PointCloud2; `data` is a view on the message."""

    stamp_ns: int
    height: int
    width: int
    fields: tuple[RawField, ...]
    big_endian: bool
    point_step: int
    row_step: int
    data: memoryview


class RawLivox(NamedTuple):
    """Livox CustomMsg; `points` is structured: offset_time (ns), x, y, z (m), reflectivity, line."""

    stamp_ns: int
    points: NDArray[np.void]


def _broken_if_malformed(parse: Callable[P, R]) -> Callable[P, R]:
    @functools.wraps(parse)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return parse(*args, **kwargs)
        except (struct.error, ValueError, IndexError) as error:
            raise BrokenMessageError(str(error)) from None

    return checked


def _order(raw: bytes | memoryview, *, cdr: bool) -> str:
    """Return the byte order of the message, '<' or '>'."""
    if not cdr or raw[:2] == CDR_LITTLE_ENDIAN:
        return "<"
    if raw[:2] == CDR_BIG_ENDIAN:
        return ">"
    msg = f"unknown encapsulation {bytes(raw[:2]).hex()}"
    raise ValueError(msg)


def _align(position: int, size: int, *, cdr: bool) -> int:
    """Return the position of the next value of `size` bytes; CDR counts from its 4 bytes of head."""
    return position + (4 - position) % size if cdr else position


def _header(raw: bytes, *, cdr: bool) -> tuple[int, int, str]:
    """Return stamp in ns, position after the header, and byte order."""
    order = _order(raw, cdr=cdr)
    # ROS 1 has a sequence number where CDR has the encapsulation: the rest lies at equal offsets.
    sec, nsec, size = struct.unpack_from(f"{order}iII" if cdr else "<III", raw, 4)
    return sec * NS_PER_S + nsec, 16 + size, order


@_broken_if_malformed
def stamp_ns(raw: bytes, *, cdr: bool) -> int:
    """Return the header stamp of any message that begins with a header."""
    return _header(raw, cdr=cdr)[0]


def _floats(raw: bytes, position: int, order: str, *, cdr: bool) -> tuple[NDArray[np.float32], int]:
    """Return a float32[] and the position after it."""
    position = _align(position, 4, cdr=cdr)
    (count,) = struct.unpack_from(f"{order}I", raw, position)
    values = np.frombuffer(raw, f"{order}f4", count, position + 4)
    return values, position + 4 + 4 * count


@_broken_if_malformed
def laser_scan(raw: bytes, *, cdr: bool) -> RawScan:
    """Read a sensor_msgs/LaserScan."""
    stamp, position, order = _header(raw, cdr=cdr)
    position = _align(position, 4, cdr=cdr)
    head = struct.unpack_from(f"{order}7f", raw, position)
    ranges, position = _floats(raw, position + 28, order, cdr=cdr)
    intensities, _ = _floats(raw, position, order, cdr=cdr)
    angle_min, _, increment, time_increment, scan_time, range_min, range_max = head
    return RawScan(
        stamp,
        angle_min,
        increment,
        time_increment,
        scan_time,
        range_min,
        range_max,
        ranges,
        intensities if len(intensities) == len(ranges) else None,
    )


@_broken_if_malformed
def multi_echo_scan(raw: bytes, *, cdr: bool) -> RawScan:
    """Read a sensor_msgs/MultiEchoLaserScan, keeping of each beam the first echo within range.

    The first echo is the nearest; later ones come from behind foliage, edges or glass.
    """
    stamp, position, order = _header(raw, cdr=cdr)
    position = _align(position, 4, cdr=cdr)
    head = struct.unpack_from(f"{order}7f", raw, position)
    angle_min, _, increment, time_increment, scan_time, range_min, range_max = head
    beams, position = _echoes(raw, position + 28, order, cdr=cdr)
    strengths, _ = _echoes(raw, position, order, cdr=cdr)
    chosen = [_first_within(echoes, range_min, range_max) for echoes in beams]
    ranges = [echoes[i] if len(echoes) else np.nan for echoes, i in zip(beams, chosen, strict=True)]
    intensities = None
    if [len(s) for s in strengths] == [len(b) for b in beams]:
        intensities = np.array(
            [s[i] if len(s) else 0.0 for s, i in zip(strengths, chosen, strict=True)], np.float32
        )
    return RawScan(
        stamp,
        angle_min,
        increment,
        time_increment,
        scan_time,
        range_min,
        range_max,
        np.array(ranges, np.float32),
        intensities,
    )


def _echoes(
    raw: bytes, position: int, order: str, *, cdr: bool
) -> tuple[list[tuple[float, ...]], int]:
    """Return a LaserEcho[] (each a float32[]) and the position after it."""
    position = _align(position, 4, cdr=cdr)
    (n_beams,) = struct.unpack_from(f"{order}I", raw, position)
    position += 4
    if 4 * n_beams > len(raw):
        msg = f"{n_beams} beams in {len(raw)} bytes"
        raise ValueError(msg)
    beams = []
    for _ in range(n_beams):
        (count,) = struct.unpack_from(f"{order}I", raw, position)
        if 4 * count > len(raw):
            msg = f"{count} echoes in {len(raw)} bytes"
            raise ValueError(msg)
        beams.append(struct.unpack_from(f"{order}{count}f", raw, position + 4))
        position += 4 + 4 * count
    return beams, position


def _first_within(echoes: tuple[float, ...], low: float, high: float) -> int:
    return next((i for i, r in enumerate(echoes) if low <= r <= high), 0)


@_broken_if_malformed
def imu(raw: bytes, *, cdr: bool) -> tuple[int, bytes, str]:
    """Return stamp, the 37 float64 of a sensor_msgs/Imu as bytes, and their byte order.

    The 37: orientation (4), covariance (9), gyro (3), covariance (9), accel (3), covariance (9).
    """
    stamp, position, order = _header(raw, cdr=cdr)
    position = _align(position, 8, cdr=cdr)
    values = raw[position : position + 296]
    if len(values) != 296:
        msg = f"{len(values)} of 296 bytes"
        raise ValueError(msg)
    return stamp, values, order


@_broken_if_malformed
def joint_position(raw: bytes, *, cdr: bool) -> tuple[int, float]:
    """Return stamp and position[0] of a sensor_msgs/JointState."""
    stamp, position, order = _header(raw, cdr=cdr)
    position = _align(position, 4, cdr=cdr)
    (n_names,) = struct.unpack_from(f"{order}I", raw, position)
    position += 4
    if 4 * n_names > len(raw):
        msg = f"{n_names} names in {len(raw)} bytes"
        raise ValueError(msg)
    for _ in range(n_names):
        position = _align(position, 4, cdr=cdr)
        (size,) = struct.unpack_from(f"{order}I", raw, position)
        position += 4 + size
    position = _align(position, 4, cdr=cdr)
    (count,) = struct.unpack_from(f"{order}I", raw, position)
    if count == 0:
        msg = "no position"
        raise ValueError(msg)
    (angle,) = struct.unpack_from(f"{order}d", raw, _align(position + 4, 8, cdr=cdr))
    return stamp, angle


@_broken_if_malformed
def point_cloud(raw: bytes, *, cdr: bool) -> RawCloud:
    """Read a sensor_msgs/PointCloud2; the points themselves stay where they are."""
    stamp, position, order = _header(raw, cdr=cdr)
    position = _align(position, 4, cdr=cdr)
    height, width, n_fields = struct.unpack_from(f"{order}3I", raw, position)
    position += 12
    if n_fields > MAX_POINT_FIELDS:
        msg = f"{n_fields} point fields"
        raise ValueError(msg)
    fields = []
    for _ in range(n_fields):
        field, position = _point_field(raw, position, order, cdr=cdr)
        fields.append(field)
    big_endian = bool(raw[position])
    position = _align(position + 1, 4, cdr=cdr)
    point_step, row_step, size = struct.unpack_from(f"{order}3I", raw, position)
    data = memoryview(raw)[position + 12 : position + 12 + size]
    if len(data) != size:
        msg = f"{len(data)} of {size} bytes"
        raise ValueError(msg)
    return RawCloud(stamp, height, width, tuple(fields), big_endian, point_step, row_step, data)


def _point_field(raw: bytes, position: int, order: str, *, cdr: bool) -> tuple[RawField, int]:
    position = _align(position, 4, cdr=cdr)
    (size,) = struct.unpack_from(f"{order}I", raw, position)
    name = raw[position + 4 : position + 4 + size].rstrip(b"\0").decode()
    position = _align(position + 4 + size, 4, cdr=cdr)
    offset, datatype = struct.unpack_from(f"{order}IB", raw, position)
    position = _align(position + 5, 4, cdr=cdr)
    (count,) = struct.unpack_from(f"{order}I", raw, position)
    return RawField(name, offset, datatype, count), position + 4


@_broken_if_malformed
def livox_custom(raw: bytes, *, cdr: bool) -> RawLivox:
    """Read a livox_ros_driver(2)/CustomMsg."""
    _, position, order = _header(raw, cdr=cdr)
    position = _align(position, 8, cdr=cdr)
    timebase_ns, n_points = struct.unpack_from(f"{order}QI", raw, position)
    position = _align(position + 12 + 4, 4, cdr=cdr)
    (count,) = struct.unpack_from(f"{order}I", raw, position)
    if count != n_points and n_points != 0:
        msg = f"{count} points announced as {n_points}"
        raise ValueError(msg)
    dtype = _livox_dtype(order, 20 if cdr else 19)
    # CDR pads between points, not after the last one.
    body = raw[position + 4 :] + (b"\0" if cdr else b"")
    points = np.frombuffer(body, dtype, count)
    stamp = _header(raw, cdr=cdr)[0]
    # The offsets count from the time base, which some drivers leave at zero.
    return RawLivox(timebase_ns if 0 < timebase_ns < 2**63 and stamp else stamp, points)


def _livox_dtype(order: str, step: int) -> np.dtype[np.void]:
    return np.dtype(
        {
            "names": ["offset_time", "x", "y", "z", "reflectivity", "line"],
            "formats": [f"{order}u4", f"{order}f4", f"{order}f4", f"{order}f4", "u1", "u1"],
            "offsets": [0, 4, 8, 12, 16, 18],
            "itemsize": step,
        }
    )
