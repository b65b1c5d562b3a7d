# SPDX-License-Identifier: MIT OR Apache-2.0
"""Files of triangles: PLY, OBJ and GLB.

Those of Open3D are not used: its OBJ has six digits, too few for projected coordinates, and its GLB
has the third axis upwards, against the standard.
"""

from __future__ import annotations

import json
import struct
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from bentwing.base.atomic import atomic_path

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Triangles = NDArray[np.int32]
    Colours = NDArray[np.uint8]

_ROWS = 100_000  # of text that are made at once
_FLOAT, _UINT = 5126, 5125  # component types of glTF
_VERTICES, _INDICES = 34962, 34963  # kinds of buffers


def write_triangles(
    path: Path, vertices: Array, triangles: Triangles, colours: Colours, origin: Array
) -> None:
    """Write triangles, atomically, in the format that the name of the file says.

    Parameters
    ----------
    path : .ply, .obj or .glb
    vertices : (V, 3) m, relative to the origin
    triangles : (T, 3) rows of vertices
    colours : (V, 3)
    origin : (3,) m
    """
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        _WRITERS[path.suffix.lower()](file, vertices, triangles, colours, origin)


def _write_ply(
    file: IO[bytes], vertices: Array, triangles: Triangles, colours: Colours, origin: Array
) -> None:
    header = [
        "ply", "format binary_little_endian 1.0", "comment bentwing",
        f"element vertex {len(vertices)}",
        *(f"property double {axis}" for axis in "xyz"),
        *(f"property uchar {name}" for name in ("red", "green", "blue")),
        f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header",
    ]  # fmt: skip
    file.write(("\n".join(header) + "\n").encode("ascii"))
    rows = np.empty(len(vertices), [("at", "<f8", 3), ("colour", "u1", 3)])
    rows["at"], rows["colour"] = vertices + origin, colours
    file.write(rows.tobytes())
    faces = np.empty(len(triangles), [("n", "u1"), ("of", "<i4", 3)])
    faces["n"], faces["of"] = 3, triangles
    file.write(faces.tobytes())


def _write_obj(
    file: IO[bytes], vertices: Array, triangles: Triangles, colours: Colours, origin: Array
) -> None:
    file.write(b"# bentwing: x y z in m, then red green blue\n")
    _write_rows(file, "v %.4f %.4f %.4f %.4f %.4f %.4f\n", [vertices + origin, colours / 255.0])
    _write_rows(file, "f %d %d %d\n", [triangles.astype(np.int64) + 1])


def _write_rows(file: IO[bytes], row: str, columns: list[NDArray[Any]]) -> None:
    for first in range(0, len(columns[0]), _ROWS):
        part = np.hstack([column[first : first + _ROWS] for column in columns])
        file.write((row * len(part) % tuple(part.ravel().tolist())).encode("ascii"))


def _write_glb(
    file: IO[bytes], vertices: Array, triangles: Triangles, colours: Colours, origin: Array
) -> None:
    upright = vertices[:, [0, 2, 1]] * [1.0, 1.0, -1.0]  # glTF has y upwards
    at = upright.astype("<f4")
    buffers = [at.tobytes(), _linear(colours).tobytes(), triangles.astype("<u4").tobytes()]
    content = json.dumps(_scene(at, len(triangles), [len(b) for b in buffers], origin)).encode()
    content += b" " * (-len(content) % 4)
    n_bytes = sum(map(len, buffers))  # each is a multiple of four
    file.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(content) + 8 + n_bytes))
    file.write(struct.pack("<I4s", len(content), b"JSON") + content)
    file.write(struct.pack("<I4s", n_bytes, b"BIN\0"))
    for buffer in buffers:
        file.write(buffer)


def _linear(colours: Colours) -> NDArray[np.float32]:
    """Return colours of screens as shares of light, which glTF wants; IEC 61966-2-1."""
    share = colours / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return light.astype("<f4")


def _scene(at: NDArray[np.float32], n_triangles: int, sizes: list[int], origin: Array) -> Any:  # noqa: ANN401
    """Return the description of one coloured mesh, whose buffers are of these sizes in bytes."""
    starts = np.concatenate([[0], np.cumsum(sizes)]).tolist()
    kinds = (_VERTICES, _VERTICES, _INDICES)
    views = [
        {"buffer": 0, "byteOffset": start, "byteLength": size, "target": kind}
        for start, size, kind in zip(starts, sizes, kinds, strict=False)
    ]
    low, high = (end.astype(float).tolist() for end in (at.min(axis=0), at.max(axis=0)))
    of_vertices = {"componentType": _FLOAT, "count": len(at), "type": "VEC3"}
    matt = {"metallicFactor": 0.0, "roughnessFactor": 1.0}
    attributes = {"POSITION": 0, "COLOR_0": 1}
    return {
        "asset": {"version": "2.0", "generator": "bentwing"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "extras": {"origin": origin.tolist()}}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 2, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": matt, "doubleSided": True}],
        "accessors": [
            {"bufferView": 0, **of_vertices, "min": low, "max": high},
            {"bufferView": 1, **of_vertices},
            {"bufferView": 2, "componentType": _UINT, "count": 3 * n_triangles, "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": starts[-1]}],
    }


_WRITERS = {".ply": _write_ply, ".obj": _write_obj, ".glb": _write_glb}
MESH_SUFFIXES = tuple(_WRITERS)
