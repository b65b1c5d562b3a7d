# SPDX-License-Identifier: MIT OR Apache-2.0
"""Read the scans of 2D lidars straight from their bytes; arguments and errors as in `wire`."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bentwing.recording.messages.wire import align, broken_if_malformed, header

if TYPE_CHECKING:
    from numpy.typing import NDArray

    _Geometry = tuple[float, float, float, float, float, float]


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


def _head(raw: bytes, *, cdr: bool) -> tuple[int, _Geometry, int, str]:
    """Return the stamp, ns, what `RawScan` has from `angle_min` to `range_max`, the position after it, and the order of bytes."""
    stamp, position, order = header(raw, cdr=cdr)
    position = align(position, 4, cdr=cdr)
    angle_min, _, *rest = struct.unpack_from(f"{order}7f", raw, position)
    increment, time_increment, scan_time, range_min, range_max = rest
    geometry = (angle_min, increment, time_increment, scan_time, range_min, range_max)
    return stamp, geometry, position + 28, order


def _floats(raw: bytes, position: int, order: str, *, cdr: bool) -> tuple[NDArray[np.float32], int]:
    """Return a float32[] and the position after it."""
    position = align(position, 4, cdr=cdr)
    (count,) = struct.unpack_from(f"{order}I", raw, position)
    values = np.frombuffer(raw, f"{order}f4", count, position + 4)
    return values, position + 4 + 4 * count


@broken_if_malformed
def laser_scan(raw: bytes, *, cdr: bool) -> RawScan:
    """Read a sensor_msgs/LaserScan."""
    stamp, geometry, position, order = _head(raw, cdr=cdr)
    ranges, position = _floats(raw, position, order, cdr=cdr)
    intensities, _ = _floats(raw, position, order, cdr=cdr)
    found = intensities if len(intensities) == len(ranges) else None
    return RawScan(stamp, *geometry, ranges, found)


@broken_if_malformed
def multi_echo_scan(raw: bytes, *, cdr: bool) -> RawScan:
    """Read a sensor_msgs/MultiEchoLaserScan, keeping of each beam the first echo within range.

    The first echo is the nearest; later ones come from behind foliage, edges or glass.
    """
    stamp, geometry, position, order = _head(raw, cdr=cdr)
    beams, position = _echoes(raw, position, order, cdr=cdr)
    strengths, _ = _echoes(raw, position, order, cdr=cdr)
    chosen = [_first_within(echoes, *geometry[-2:]) for echoes in beams]
    ranges = [echoes[i] if len(echoes) else np.nan for echoes, i in zip(beams, chosen, strict=True)]
    intensities = None
    if [len(s) for s in strengths] == [len(b) for b in beams]:
        intensities = np.array(
            [s[i] if len(s) else 0.0 for s, i in zip(strengths, chosen, strict=True)], np.float32
        )
    return RawScan(stamp, *geometry, np.array(ranges, np.float32), intensities)


def _echoes(
    raw: bytes, position: int, order: str, *, cdr: bool
) -> tuple[list[tuple[float, ...]], int]:
    """Return a LaserEcho[] (each a float32[]) and the position after it."""
    position = align(position, 4, cdr=cdr)
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
