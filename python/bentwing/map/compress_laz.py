# SPDX-License-Identifier: MIT OR Apache-2.0
"""Compression for laspy's writer that lets the recording be read meanwhile."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from laspy.vlrs.known import LasZipVlr

from bentwing import _core

if TYPE_CHECKING:
    from pathlib import Path

    from laspy import LasHeader, PackedPointRecord


class LazBackend:
    """What `laspy.LasWriter` takes for `laz_backend`, for a file at `path`.

    laspy's own backends hold the GIL while they compress.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def is_available(self) -> bool:
        """Whether it can be used: always, it is part of the compiled core."""
        return True

    def create_writer(self, dest: BinaryIO, header: LasHeader) -> _PointWriter:
        """Return the writer of the points of `dest`, which is open at the path."""
        return _PointWriter(self._path, dest, header)


class _PointWriter:
    def __init__(self, path: Path, dest: BinaryIO, header: LasHeader) -> None:
        self._path = path
        self._dest = dest
        point_format = header.point_format
        self._compressor = _core.LazCompressor(point_format.id, point_format.num_extra_bytes)

    def write_initial_header_and_vlrs(self, header: LasHeader, encoding_errors: str) -> None:
        header.vlrs.append(LasZipVlr(self._compressor.record_data()))
        header.write_to(self._dest, encoding_errors=encoding_errors)
        self._dest.flush()
        self._compressor.begin(self._path, self._dest.tell())

    def write_points(self, points: PackedPointRecord) -> None:
        self._compressor.compress(np.frombuffer(points.array, np.uint8))

    def done(self) -> None:
        self._compressor.finish()

    def write_updated_header(self, header: LasHeader, encoding_errors: str) -> None:
        self._dest.seek(0, io.SEEK_SET)
        header.write_to(self._dest, ensure_same_size=True, encoding_errors=encoding_errors)
