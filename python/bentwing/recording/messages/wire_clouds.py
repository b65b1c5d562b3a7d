# SPDX-License-Identifier: MIT OR Apache-2.0
"""Read the clouds of 3D lidars straight from their bytes; arguments and errors as in `wire`."""

from __future__ import annotations

import struct
from typing import NamedTuple

from bentwing.recording.messages.wire import align, broken_if_malformed, header

MAX_POINT_FIELDS = 64


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


@broken_if_malformed
def point_cloud(raw: bytes, *, cdr: bool) -> RawCloud:
    """Read a sensor_msgs/PointCloud2; the points themselves stay where they are."""
    stamp, position, order = header(raw, cdr=cdr)
    position = align(position, 4, cdr=cdr)
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
    position = align(position + 1, 4, cdr=cdr)
    point_step, row_step, size = struct.unpack_from(f"{order}3I", raw, position)
    data = memoryview(raw)[position + 12 : position + 12 + size]
    if len(data) != size:
        msg = f"{len(data)} of {size} bytes"
        raise ValueError(msg)
    return RawCloud(stamp, height, width, tuple(fields), big_endian, point_step, row_step, data)


def _point_field(raw: bytes, position: int, order: str, *, cdr: bool) -> tuple[RawField, int]:
    position = align(position, 4, cdr=cdr)
    (size,) = struct.unpack_from(f"{order}I", raw, position)
    name = raw[position + 4 : position + 4 + size].rstrip(b"\0").decode()
    position = align(position + 4 + size, 4, cdr=cdr)
    offset, datatype = struct.unpack_from(f"{order}IB", raw, position)
    position = align(position + 5, 4, cdr=cdr)
    (count,) = struct.unpack_from(f"{order}I", raw, position)
    return RawField(name, offset, datatype, count), position + 4
