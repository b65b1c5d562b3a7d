# SPDX-License-Identifier: MIT OR Apache-2.0
"""Triangles of PLY files: the true surface beside a simulated recording, or a design model."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from bentwing.base.errors import InputError
from bentwing.base.regular_file import require_regular
from bentwing.map.read_rows import PLY_TYPES, header_lines

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Mesh:
    """Vertices (V, 3) float64, m, and triangles (T, 3) uint32 of vertex numbers."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.uint32]


def read_mesh(path: Path) -> Mesh | None:
    """Read a PLY mesh of triangles; None for any file without faces.

    Raises
    ------
    InputError
        If there are faces that are no triangles, or the file is damaged or truncated.
    """
    if path.suffix.lower() != ".ply":
        return None
    require_regular(path)
    try:
        with path.open("rb") as file:
            lines = header_lines(path, file, "end_header")
            n_vertices, n_faces = (_count(lines, name) for name in ("vertex", "face"))
            if not n_faces:
                return None
            vertices, triangles = _tables(lines, file, n_vertices, n_faces)
    except OSError as error:
        msg = f"{path}: not readable ({error.strerror})"
        raise InputError(msg) from error
    except (ValueError, KeyError, IndexError) as error:
        msg = (
            f"{path}: its faces are not readable ({error}); write a mesh of triangles as binary "
            "little-endian PLY without further properties of the faces, or the points alone"
        )
        raise InputError(msg) from error
    if len(vertices) and np.isfinite(vertices).all() and triangles.max() < len(vertices):
        return Mesh(vertices, triangles)
    msg = f"{path}: its triangles name vertices that are not there or not finite; it is damaged"
    raise InputError(msg)


def _count(lines: list[list[str]], element: str) -> int:
    counts = [words[2] for words in lines if words[:2] == ["element", element] and len(words) > 2]
    return int(counts[0]) if counts and counts[0].isdigit() else 0


def _tables(
    lines: list[list[str]], file: BinaryIO, n_vertices: int, n_faces: int
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    properties = [words for words in lines if words[0] == "property"]
    (faces,) = [words for words in properties if words[1] == "list"]
    if ["format", "binary_little_endian"] not in [words[:2] for words in lines] or (
        properties[-1] is not faces
    ):
        msg = "binary little-endian rows, the list of vertices last, were expected"
        raise ValueError(msg)
    vertex = np.dtype([(w[2], "<" + PLY_TYPES[w[1]]) for w in properties[:-1]])
    rows = _rows(file, vertex, n_vertices)
    number, index = ("<" + PLY_TYPES[kind] for kind in faces[2:4])
    table = _rows(file, np.dtype([("n", number), ("corners", index, 3)]), n_faces)
    if (table["n"] != 3).any():
        msg = "a face has other than three corners"
        raise ValueError(msg)
    vertices = np.stack([rows[axis].astype(np.float64) for axis in "xyz"], axis=1)
    return vertices, table["corners"].astype(np.uint32)


def _rows(file: BinaryIO, dtype: np.dtype[Any], count: int) -> NDArray[Any]:
    left = os.fstat(file.fileno()).st_size - file.tell()
    data = file.read(min(left, dtype.itemsize * count))
    if len(data) < dtype.itemsize * count:
        msg = f"{count} rows are announced, {len(data) // dtype.itemsize} are there"
        raise ValueError(msg)
    return np.frombuffer(data, dtype)
