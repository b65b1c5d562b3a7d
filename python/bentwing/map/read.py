# SPDX-License-Identifier: MIT OR Apache-2.0
"""Read the points of a map back, ours or one of another program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from bentwing.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

_PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
_MAX_HEADER_LINES = 1000


def read_points(path: Path) -> NDArray[np.float64]:
    """Read the coordinates of a .laz, .las, .ply or .pcd file.

    Returns
    -------
    (N, 3) float64, m

    Raises
    ------
    InputError
        If the file is of another kind, damaged or truncated.
    """
    path = Path(path)
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        msg = f"{path}: maps are read from {', '.join(_READERS)} files; convert it first"
        raise InputError(msg)
    try:
        return reader(path)
    except InputError:
        raise
    except Exception as error:
        # Parsers of foreign files fail in every way there is; the file is what the user can change.
        msg = f"{path}: not readable as {path.suffix.lower()[1:].upper()} ({error})"
        raise InputError(msg) from error


def _read_las(path: Path) -> NDArray[np.float64]:
    import laspy  # PLY and PCD are read without it

    with laspy.open(path) as file:
        points = np.empty((file.header.point_count, 3))
        n = 0
        for part in file.chunk_iterator(1_000_000):
            points[n : n + len(part), 0] = part.x
            points[n : n + len(part), 1] = part.y
            points[n : n + len(part), 2] = part.z
            n += len(part)
    return _complete(path, points[:n], len(points))


def _read_ply(path: Path) -> NDArray[np.float64]:
    with path.open("rb") as file:
        encoding, count, fields = _ply_header(path, file)
        if encoding == "ascii":
            return _ascii_rows(path, file, [name for name, _ in fields], count)
        order = "<" if encoding == "binary_little_endian" else ">"
        dtype = np.dtype([(name, order + kind) for name, kind in fields])
        return _binary_rows(path, file, dtype, count)


def _ply_header(path: Path, file: BinaryIO) -> tuple[str, int, list[tuple[str, str]]]:
    encoding, element, count = "", "", 0
    fields: list[tuple[str, str]] = []
    for words in _header_lines(path, file, "end_header"):
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
            fields.append((words[2], _PLY_TYPES[words[1]]))
    if encoding not in {"ascii", "binary_little_endian", "binary_big_endian"}:
        msg = f"{path}: not a PLY file"
        raise InputError(msg)
    return encoding, count, fields


def _read_pcd(path: Path) -> NDArray[np.float64]:
    with path.open("rb") as file:
        header = {words[0]: words[1:] for words in _header_lines(path, file, "DATA")}
        kinds = zip(header["TYPE"], header["SIZE"], strict=True)
        counts = header.get("COUNT", ["1"] * len(header["FIELDS"]))
        columns = list(zip(header["FIELDS"], kinds, counts, strict=True))
        count = int(header["POINTS"][0])
        if header["DATA"][0] == "ascii":
            names = [name for name, _, repeat in columns for _ in range(int(repeat))]
            return _ascii_rows(path, file, names, count)
        if header["DATA"][0] != "binary":
            msg = (
                f"{path}: PCD data of kind {header['DATA'][0]!r} are not read; convert it to binary"
            )
            raise InputError(msg)
        fields = [
            (f"{name}{i}" if name == "_" else name, f"<{kind.lower()}{size}", (int(repeat),))
            for i, (name, (kind, size), repeat) in enumerate(columns)
        ]
        return _binary_rows(path, file, np.dtype(fields), count)


def _header_lines(path: Path, file: BinaryIO, last: str) -> list[list[str]]:
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


def _binary_rows(
    path: Path, file: BinaryIO, dtype: np.dtype[Any], count: int
) -> NDArray[np.float64]:
    points = np.empty((min(count, path.stat().st_size // dtype.itemsize), 3))
    n = 0
    while n < len(points):
        table = np.frombuffer(file.read(dtype.itemsize * min(1_000_000, len(points) - n)), dtype)
        if not len(table):
            break
        for axis, name in enumerate("xyz"):
            points[n : n + len(table), axis] = table[name].reshape(len(table))
        n += len(table)
    return _complete(path, points[:n], count)


def _ascii_rows(path: Path, file: BinaryIO, names: list[str], count: int) -> NDArray[np.float64]:
    columns = [names.index(name) for name in "xyz"]
    if count == 0:
        return np.empty((0, 3))
    return _complete(path, np.loadtxt(file, usecols=columns, max_rows=count, ndmin=2), count)


def _complete(path: Path, points: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    if len(points) != count:
        msg = f"{path}: announces {count} points, holds {len(points)}; it is truncated"
        raise InputError(msg)
    return points


_READERS: dict[str, Callable[[Path], NDArray[np.float64]]] = {
    ".laz": _read_las,
    ".las": _read_las,
    ".ply": _read_ply,
    ".pcd": _read_pcd,
}
