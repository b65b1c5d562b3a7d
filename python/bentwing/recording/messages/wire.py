# SPDX-License-Identifier: MIT OR Apache-2.0
"""Read the few message types a recording needs straight from their bytes: IMU and encoder.

The lidar's types are in `wire_scans` and `wire_clouds`.

These types have not changed since ROS 1, so recordings without message definitions, or with
damaged ones, can be read too; and an Imu message, of which there are most, takes a sixth of the
time of a generic deserializer (a scan about the same).

Every function takes `(raw, cdr)`, `cdr` telling ROS 2's encoding (CDR, aligned) from ROS 1's
(packed), and raises `BrokenMessageError` for bytes that are no such message.
"""

from __future__ import annotations

import functools
import struct
from typing import TYPE_CHECKING, NamedTuple, ParamSpec, TypeVar

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable


P = ParamSpec("P")
R = TypeVar("R")

NS_PER_S = 1_000_000_000
CDR_BIG_ENDIAN, CDR_LITTLE_ENDIAN = b"\x00\x00", b"\x00\x01"


class BrokenMessageError(ValueError):
    """The bytes are not a message of the expected type."""


def broken_if_malformed(parse: Callable[P, R]) -> Callable[P, R]:
    """Turn what struct and numpy raise for bytes that do not fit into BrokenMessageError."""

    @functools.wraps(parse)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return parse(*args, **kwargs)
        except (struct.error, ValueError, IndexError) as error:
            raise BrokenMessageError(str(error)) from None

    return checked


def byte_order(raw: bytes | memoryview, *, cdr: bool) -> str:
    """Return the byte order of the message, '<' or '>'."""
    if not cdr or raw[:2] == CDR_LITTLE_ENDIAN:
        return "<"
    if raw[:2] == CDR_BIG_ENDIAN:
        return ">"
    msg = f"unknown encapsulation {bytes(raw[:2]).hex()}"
    raise ValueError(msg)


def align(position: int, size: int, *, cdr: bool) -> int:
    """Return the position of the next value of `size` bytes; CDR counts from its 4 bytes of head."""
    return position + (4 - position) % size if cdr else position


def header(raw: bytes, *, cdr: bool) -> tuple[int, int, str]:
    """Return stamp in ns, position after the header, and byte order."""
    order = byte_order(raw, cdr=cdr)
    # ROS 1 has a sequence number where CDR has the encapsulation: the rest lies at equal offsets.
    sec, nsec, size = struct.unpack_from(f"{order}iII" if cdr else "<III", raw, 4)
    return sec * NS_PER_S + nsec, 16 + size, order


@broken_if_malformed
def stamp_ns(raw: bytes, *, cdr: bool) -> int:
    """Return the header stamp of any message that begins with a header."""
    return header(raw, cdr=cdr)[0]


@broken_if_malformed
def frame_id(raw: bytes, *, cdr: bool) -> str:
    """Return the frame in the header of any message that begins with one."""
    _, end, _ = header(raw, cdr=cdr)
    return frame_name(raw[16:end])


def frame_name(raw: bytes) -> str:
    """Return a frame's name, without CDR's final zero and the slash in front that the first tf had."""
    return raw.rstrip(b"\0").decode("utf-8", "replace").strip("/")


@broken_if_malformed
def imu(raw: bytes, *, cdr: bool) -> tuple[int, bytes]:
    """Return stamp and the 37 little-endian float64 of a sensor_msgs/Imu as bytes.

    The 37: orientation (4), covariance (9), gyro (3), covariance (9), accel (3), covariance (9).
    """
    stamp, position, order = header(raw, cdr=cdr)
    position = align(position, 8, cdr=cdr)
    values = raw[position : position + 296]
    if len(values) != 296:
        msg = f"{len(values)} of 296 bytes"
        raise ValueError(msg)
    return stamp, values if order == "<" else np.frombuffer(values, ">f8").astype("<f8").tobytes()


class Joints(NamedTuple):
    """Names and positions of a sensor_msgs/JointState; some drivers leave the names out."""

    names: tuple[str, ...]
    positions: tuple[float, ...]

    def position(self, name: str | None) -> float | None:
        """Return the position of a joint, None without it; no name means the first joint."""
        if name is None:
            return self.positions[0]
        index = self.names.index(name) if name in self.names else len(self.positions)
        return self.positions[index] if index < len(self.positions) else None


@broken_if_malformed
def joints(raw: bytes, *, cdr: bool) -> tuple[int, Joints]:
    """Return stamp and joints, at least one, of a sensor_msgs/JointState."""
    stamp, position, order = header(raw, cdr=cdr)
    position = align(position, 4, cdr=cdr)
    (n_names,) = struct.unpack_from(f"{order}I", raw, position)
    position += 4
    if 4 * n_names > len(raw):
        msg = f"{n_names} names in {len(raw)} bytes"
        raise ValueError(msg)
    names = []
    for _ in range(n_names):
        position = align(position, 4, cdr=cdr)
        (size,) = struct.unpack_from(f"{order}I", raw, position)
        text = raw[position + 4 : position + 4 + size]
        names.append(text.rstrip(b"\0").decode("utf-8", "replace"))  # CDR counts a final zero
        position += 4 + size
    position = align(position, 4, cdr=cdr)
    (count,) = struct.unpack_from(f"{order}I", raw, position)
    if count == 0:
        msg = "no position"
        raise ValueError(msg)
    position = align(position + 4, 8, cdr=cdr)
    if 8 * count > len(raw):
        msg = f"{count} positions in {len(raw)} bytes"
        raise ValueError(msg)
    return stamp, Joints(tuple(names), struct.unpack_from(f"{order}{count}d", raw, position))
