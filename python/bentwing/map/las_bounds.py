# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether a LAS or LAZ file can hold what it announces, before a library makes room for it."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, BinaryIO

import lazrs  # type: ignore[import-untyped]

from bentwing.base.errors import InputError
from bentwing.map.laz_chunks import problem_of_chunks

if TYPE_CHECKING:
    from pathlib import Path

_HEADER = 375  # bytes of the longest header, of version 1.4
_SHORTEST = 227  # of the shortest one
_LASZIP = 22204  # number of the record of the compression
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
            file.seek(header_size)
            vlr = _compression(path, file, n_records)
            _require(path, vlr.item_size() == record_length, "points of another size")
            wrong = problem_of_chunks(file, vlr, (start, size), n_points)
            _require(path, wrong is None, wrong or "")


def _compression(path: Path, file: BinaryIO, n_records: int) -> lazrs.LazVlr:
    """Return the record that says how the points are compressed; the records follow the header."""
    for _ in range(n_records):
        head = file.read(_VLR).ljust(_VLR, b"\0")
        number, size = struct.unpack_from("<HH", head, 18)
        content = file.read(size)
        if head[2:18].rstrip(b"\0") == b"laszip encoded" and number == _LASZIP:
            return lazrs.LazVlr(content)
    msg = f"{path}: has no record that says how its points are compressed; it is damaged"
    raise InputError(msg)


def _require(path: Path, is_sound: bool, what: str) -> None:  # noqa: FBT001 - reads as a sentence
    if not is_sound:
        msg = f"{path}: announces {what} that the file cannot hold; it is damaged or truncated"
        raise InputError(msg)
