# SPDX-License-Identifier: MIT OR Apache-2.0
"""Pictures and heights from above as GeoTIFF, which knows where on Earth it lies."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.atomic import write_bytes
from bentwing.base.errors import UsageError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.report.picture import View

_ASCII, _SHORT, _LONG, _DOUBLE = 2, 3, 4, 12  # types of TIFF
_FORMATS = {_ASCII: "B", _SHORT: "H", _LONG: "I", _DOUBLE: "d"}
_DEFLATE, _GREY, _RGB, _HORIZONTAL, _FLOAT = 8, 1, 2, 2, 3
_STRIP = 64  # rows
_GEOGRAPHIC = range(4000, 5000)  # EPSG codes of latitude and longitude
_LARGEST_CODE = 32_767

Tag = tuple[int, int, tuple[float, ...]]


def write_geotiff(path: Path, view: View, epsg: int) -> None:
    """Write a view from above, whose axes are those of a projected coordinate system.

    Parameters
    ----------
    path : file to write, atomically
    view : `left` and `top` are easting and northing of its upper left corner, m
    epsg : code of the projected coordinate system

    Raises
    ------
    UsageError
        If the code is not that of a projected system.

    References
    ----------
    OGC 19-008r4, GeoTIFF 1.1.
    """
    _write(path, view.image, (view.pixel, view.left, view.top), epsg)


def write_raster(
    path: Path,
    values: NDArray[np.float32],
    place: tuple[float, float, float],
    epsg: int | None,
) -> None:
    """Write values seen from above, as heights of a terrain.

    Parameters
    ----------
    path : file to write, atomically
    values : (H, W), first row on top, NaN where there is none
    place : m, edge of a pixel, and left and top of the upper left corner
    epsg : code of the projected coordinate system; None for a frame that has no place on Earth

    Raises
    ------
    UsageError
        If the code is not that of a projected system.
    """
    _write(path, values, place, epsg)


def _write(
    path: Path, image: NDArray[np.generic], place: tuple[float, float, float], epsg: int | None
) -> None:
    _require_projected(epsg)
    pixel, left, top = place
    rows, columns = image.shape[:2]
    is_picture = image.ndim == 3
    strips = [_compressed(image[at : at + _STRIP]) for at in range(0, rows, _STRIP)]
    starts = 8 + np.concatenate([[0], np.cumsum([len(strip) for strip in strips])])
    # Projected or of no known system; a pixel is an area.
    keys: tuple[int, ...] = (1, 1, 0, 1, 1025, 0, 1, 1)
    if epsg is not None:
        keys = (1, 1, 1, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, epsg)
    tags: list[Tag] = [
        (256, _LONG, (columns,)),
        (257, _LONG, (rows,)),
        (258, _SHORT, (8, 8, 8) if is_picture else (32,)),
        (259, _SHORT, (_DEFLATE,)),
        (262, _SHORT, (_RGB if is_picture else _GREY,)),
        (273, _LONG, tuple(starts[:-1].tolist())),
        (277, _SHORT, (3 if is_picture else 1,)),
        (278, _LONG, (_STRIP,)),
        (279, _LONG, tuple(len(strip) for strip in strips)),
        *([(317, _SHORT, (_HORIZONTAL,))] if is_picture else [(339, _SHORT, (_FLOAT,))]),
        (33550, _DOUBLE, (pixel, pixel, 0.0)),
        (33922, _DOUBLE, (0.0, 0.0, 0.0, left, top, 0.0)),
        (34735, _SHORT, keys),
        *([] if is_picture else [(42113, _ASCII, tuple(b"nan\0"))]),
    ]
    body = b"".join(strips)
    if len(body) % 2:
        body += b"\0"
    at = 8 + len(body)
    write_bytes(path, struct.pack("<2sHI", b"II", 42, at) + body + _directory(tags, at))


def _require_projected(epsg: int | None) -> None:
    if epsg is not None and (not 1024 <= epsg <= _LARGEST_CODE or epsg in _GEOGRAPHIC):
        msg = f"EPSG:{epsg} is not a projected coordinate system; give that of a UTM zone, such as 32633"
        raise UsageError(msg)


def _compressed(rows: NDArray[np.generic]) -> bytes:
    """Differences along each row compress better than colours; values stay as they are."""
    if rows.ndim == 2:
        return zlib.compress(np.ascontiguousarray(rows, "<f4").tobytes(), 6)
    left = np.zeros_like(rows)
    left[:, 1:] = rows[:, :-1]
    return zlib.compress(np.ascontiguousarray(rows - left).tobytes(), 6)


def _directory(tags: list[Tag], at: int) -> bytes:
    """Return the image file directory that begins at a byte, with what does not fit into it."""
    beyond = at + 2 + 12 * len(tags) + 4
    entries, rest = [struct.pack("<H", len(tags))], b""
    for tag, kind, values in tags:
        data = struct.pack(f"<{len(values)}{_FORMATS[kind]}", *values)
        if len(data) > 4:
            pointed, rest = struct.pack("<I", beyond + len(rest)), rest + data
        else:
            pointed = data.ljust(4, b"\0")
        entries.append(struct.pack("<HHI", tag, kind, len(values)) + pointed)
    return b"".join(entries) + struct.pack("<I", 0) + rest
