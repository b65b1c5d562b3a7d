# SPDX-License-Identifier: MIT OR Apache-2.0
"""PLY and PCD: a header in lines of text, then rows of numbers."""

from __future__ import annotations

import mmap
import tempfile
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from bentwing.base.errors import InputError
from bentwing.map.lzf import decompress_lzf

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    Table = tuple[NDArray[np.float64], NDArray[np.float64] | None]

PART = 1_000_000  # points that are read at once, at most
PART_BYTES = 2**26  # and no more than this of the file
PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
PCD_OFFSET = "# add to x y z:"
_TIME = "time"  # the column our own files have
_MAX_HEADER_LINES = 1000
_MOST_COLUMNS = 10_000
_WIDEST = 2**20  # bytes of a point
_LONGEST_LINE = 2**20  # bytes
_MOST_EXPANDED = 100  # bytes that LZF makes of one


def ply_rows(path: Path) -> Iterator[Table]:
    """Read coordinates and times of a PLY file part by part."""
    with path.open("rb") as file:
        encoding, count, fields = _ply_vertices(path, header_lines(path, file, "end_header"))
        if encoding == "ascii":
            yield from _ascii_rows(path, file, [name for name, _ in fields], count)
            return
        order = "<" if encoding == "binary_little_endian" else ">"
        dtype = np.dtype([(name, order + kind) for name, kind in fields])
        yield from _binary_rows(path, file, dtype, count)


def _ply_vertices(path: Path, lines: list[list[str]]) -> tuple[str, int, list[tuple[str, str]]]:
    encoding, element, count = "", "", 0
    fields: list[tuple[str, str]] = []
    for words in lines:
        if words[0] == "format":
            encoding = words[1]
        elif words[0] == "element":
            if not element and words[1] != "vertex":
                msg = (
                    f"{path}: element {words[1]!r} stands before the vertices; write vertices first"
                )
                raise InputError(msg)
            element = words[1]
            count = int(words[2]) if element == "vertex" else count
        elif words[0] == "property" and element == "vertex":
            fields.append((words[2], PLY_TYPES[words[1]]))
    if encoding not in {"ascii", "binary_little_endian", "binary_big_endian"}:
        msg = f"{path}: not a PLY file"
        raise InputError(msg)
    return encoding, count, fields


def pcd_rows(path: Path) -> Iterator[Table]:
    """Read coordinates and times of a PCD file part by part."""
    with path.open("rb") as file:
        offset = _pcd_offset(file)
        header = {words[0]: words[1:] for words in header_lines(path, file, "DATA")}
        kinds = zip(header["TYPE"], header["SIZE"], strict=True)
        counts = header.get("COUNT", ["1"] * len(header["FIELDS"]))
        if (n_columns := sum(map(int, counts))) > _MOST_COLUMNS:
            msg = f"{path}: announces {n_columns} columns; it is damaged"
            raise InputError(msg)
        columns = list(zip(header["FIELDS"], kinds, counts, strict=True))
        count = int(header["POINTS"][0])
        if header["DATA"][0] == "ascii":
            names = [name for name, _, repeat in columns for _ in range(int(repeat))]
            yield from _ascii_rows(path, file, names, count)
            return
        if header["DATA"][0] not in {"binary", "binary_compressed"}:
            msg = (
                f"{path}: PCD data of kind {header['DATA'][0]!r} are not read; convert it to binary"
            )
            raise InputError(msg)
        fields = [
            (f"{name}{i}" if name == "_" else name, f"<{kind.lower()}{size}", (int(repeat),))
            for i, (name, (kind, size), repeat) in enumerate(columns)
        ]
        if header["DATA"][0] == "binary":
            for points, times in _binary_rows(path, file, np.dtype(fields), count):
                yield points + offset, times
        else:
            yield from _compressed_columns(path, file, np.dtype(fields), count)


def _pcd_offset(file: BinaryIO) -> NDArray[np.float64]:
    """Return what to add to the coordinates of one of our own maps; leaves the file where it is."""
    start = file.tell()
    lines = [file.readline(10_000) for _ in range(10)]
    file.seek(start)
    found = [line.decode("ascii", "replace")[len(PCD_OFFSET) :] for line in lines
             if line.startswith(PCD_OFFSET.encode())]  # fmt: skip
    return np.array(found[0].split(), np.float64) if found else np.zeros(3)


def _compressed_columns(
    path: Path, file: BinaryIO, dtype: np.dtype[Any], count: int
) -> Iterator[Table]:
    """Read points that were compressed at once, column after column.

    Decompressed they are many times the file, so they go to the disk.
    """
    sizes = file.read(8)
    if len(sizes) < 8:
        _refuse_truncated(path, count, 0)
    compressed, size = (int(n) for n in np.frombuffer(sizes, "<u4"))
    if size != count * dtype.itemsize:
        msg = f"{path}: announces {count} points of {dtype.itemsize} bytes, holds {size} bytes"
        raise InputError(msg)
    begin, end = file.tell(), path.stat().st_size
    if begin + compressed > end or size > _MOST_EXPANDED * compressed:
        _refuse_truncated(path, count, 0)
    if not count:
        return
    with (
        mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as mapped,
        memoryview(mapped) as whole,
        whole[begin : begin + compressed] as packed,
        tempfile.TemporaryFile() as unpacked,
    ):
        for block in decompress_lzf(packed, size):
            unpacked.write(block)
        yield from _columns(unpacked, dtype, count)


def _columns(file: BinaryIO, dtype: np.dtype[Any], count: int) -> Iterator[Table]:
    """Read the columns of points part by part."""
    starts, at = {}, 0
    for name in dtype.names or ():
        starts[name] = at
        at += count * dtype[name].itemsize

    def column(name: str, first: int, n: int) -> NDArray[np.float64]:
        kind = dtype[name].base
        file.seek(starts[name] + first * kind.itemsize)
        return np.frombuffer(file.read(n * kind.itemsize), kind).astype(np.float64)

    for first in range(0, count, PART):
        n = min(PART, count - first)
        points = np.stack([column(axis, first, n) for axis in "xyz"], axis=1)
        yield points, column(_TIME, first, n) if _TIME in starts else None


def header_lines(path: Path, file: BinaryIO, last: str) -> list[list[str]]:
    """Words of the header's lines up to the one that starts with `last`."""
    lines: list[list[str]] = []
    for _ in range(_MAX_HEADER_LINES):
        line = file.readline(10_000)
        words = line.decode("ascii", errors="replace").split()
        if words and not words[0].startswith("#"):
            lines.append(words)
        if not line or (words and words[0] == last):
            break
    if not lines or lines[-1][0] != last:
        msg = f"{path}: its header has no end ({last!r} not found)"
        raise InputError(msg)
    return lines


def _binary_rows(path: Path, file: BinaryIO, dtype: np.dtype[Any], count: int) -> Iterator[Table]:
    if dtype.itemsize > _WIDEST:
        msg = f"{path}: announces points of {dtype.itemsize} bytes; it is damaged"
        raise InputError(msg)
    most = min(PART, max(1, PART_BYTES // max(1, dtype.itemsize)))
    n = 0
    has_times = _TIME in (dtype.names or ())
    while n < count:
        data = file.read(dtype.itemsize * min(most, count - n))
        table = np.frombuffer(data, dtype, len(data) // dtype.itemsize)
        if not len(table):
            _refuse_truncated(path, count, n)
        n += len(table)
        points = [table[name].reshape(len(table)).astype(np.float64) for name in "xyz"]
        times = table[_TIME].reshape(len(table)).astype(np.float64) if has_times else None
        yield np.stack(points, axis=1), times


def _ascii_rows(path: Path, file: BinaryIO, names: list[str], count: int) -> Iterator[Table]:
    columns = [names.index(name) for name in ("x", "y", "z", _TIME)[: 3 + (_TIME in names)]]
    n = 0
    while n < count:
        lines = _lines(path, file, min(PART, count - n))
        rows = np.loadtxt(lines, usecols=columns, ndmin=2) if lines else np.empty((0, 3))
        if not len(rows):
            _refuse_truncated(path, count, n)
        n += len(rows)
        yield np.ascontiguousarray(rows[:, :3]), rows[:, 3].copy() if _TIME in names else None


def _lines(path: Path, file: BinaryIO, most: int) -> list[bytes]:
    """Return the next lines, as many as may be in memory."""
    lines: list[bytes] = []
    left = PART_BYTES
    while len(lines) < most and left > 0 and (line := file.readline(_LONGEST_LINE)):
        if len(line) == _LONGEST_LINE:
            msg = f"{path}: has a line of more than {_LONGEST_LINE} bytes; it is damaged"
            raise InputError(msg)
        lines.append(line)
        left -= len(line)
    return lines


def _refuse_truncated(path: Path, count: int, found: int) -> None:
    msg = f"{path}: announces {count} points, holds {found}; it is truncated"
    raise InputError(msg)
