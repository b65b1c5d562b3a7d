# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether a LAS or LAZ file can hold what it announces, before a library makes room for it."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, BinaryIO

from bentwing.base.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

_HEADER = 375  # bytes of the longest header, of version 1.4
_SHORTEST = 227  # of the shortest one
_VLR, _EVLR = 54, 60  # bytes of their headers
_MOST_RECORDS = 10_000  # files have some dozen; each becomes an object
_IS_COMPRESSED = 0x80  # of the point format


def require_sound_las(path: Path) -> None:
    """Refuse a file whose header announces more than its bytes can hold.

    Decoders make room for what is announced, and a single wrong byte announces gigabytes.

    Raises
    ------
    InputError
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_HEADER).ljust(_HEADER, b"\0")
        if head[:4] != b"LASF" or size < _SHORTEST:
            msg = f"{path}: not a LAS file"
            raise InputError(msg)
        header_size, start, n_records = struct.unpack_from("<HII", head, 94)
        point_format, record_length, n_points = struct.unpack_from("<BHI", head, 104)
        evlrs, n_evlrs, n_more = struct.unpack_from("<QIQ", head, 235)
        is_new = head[24:26] >= b"\1\4"
        if is_new:
            n_points = n_more
            fits = n_evlrs <= _MOST_RECORDS and evlrs + n_evlrs * _EVLR <= size
            _require(path, not n_evlrs or fits, "extended records")
        _require(path, _SHORTEST <= header_size <= start <= size, "a header")
        fits = n_records <= _MOST_RECORDS and n_records * _VLR <= start - header_size
        _require(path, fits, "records")
        if not point_format & _IS_COMPRESSED:
            _require(path, start + n_points * record_length <= size, "points")
        elif n_points:
            _require_chunks(path, file, (start, size), n_points)


def _require_chunks(path: Path, file: BinaryIO, span: tuple[int, int], n_points: int) -> None:
    """Check the table of compressed chunks, which the first eight bytes of the points lead to."""
    start, size = span
    table = _int64(file, start)
    if table == -1:  # written as a stream: it stands at the end
        table = _int64(file, size - 8)
    _require(path, start + 8 <= table <= size - 8, "a table of chunks")
    file.seek(table)
    version, n_chunks = struct.unpack("<II", file.read(8))
    # A chunk holds a point at least, and takes a byte at least.
    _require(path, version == 0 and n_chunks <= min(n_points, table - start), "a table of chunks")


def _int64(file: BinaryIO, at: int) -> int:
    file.seek(at)
    (value,) = struct.unpack("<q", file.read(8).ljust(8, b"\0"))
    return int(value)


def _require(path: Path, is_sound: bool, what: str) -> None:  # noqa: FBT001 - reads as a sentence
    if not is_sound:
        msg = f"{path}: announces {what} that the file cannot hold; it is damaged or truncated"
        raise InputError(msg)
