# SPDX-License-Identifier: MIT OR Apache-2.0
"""The rows of the self-describing formats, and headers whose length does not depend on the count."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bentwing.map.chunk import MapChunk

_LARGEST_COUNT = 10**15
_OPTIONAL = {
    "intensity": "<f4",
    "ring": "<u2",
    "incidence": "<f4",
    "thickness": "<f4",
    "shift": "<f4",
    "sigma": "<f4",
    "run_id": "<u2",
}


# Of the normals, under the names that each format has for them.
NORMALS = ("normal_x", "normal_y", "normal_z")


def row_type(
    first: MapChunk, coordinate: str, normals: tuple[str, ...] = NORMALS
) -> np.dtype[np.void]:
    """Packed little-endian row: x y z (of type `coordinate`), time, and what the chunk has.

    The angle of incidence is in degrees.
    """
    fields = [
        ("x", coordinate),
        ("y", coordinate),
        ("z", coordinate),
        ("time", "<f8"),
        ("range", "<f4"),
    ]
    fields += [(name, kind) for name, kind in _OPTIONAL.items() if getattr(first, name) is not None]
    return np.dtype(fields + further_fields(first, normals))


def rows(
    chunk: MapChunk, dtype: np.dtype[np.void], normals: tuple[str, ...] = NORMALS
) -> NDArray[np.void]:
    """Rows `(N,)` of a chunk; what it does not have is zero."""
    table = np.zeros(len(chunk), dtype)
    for axis, name in enumerate("xyz"):
        table[name] = chunk.points[:, axis]
    table["time"], table["range"] = chunk.times, chunk.ranges
    for name in _OPTIONAL:
        values = getattr(chunk, name)
        if values is not None and name in (dtype.names or ()):
            table[name] = np.degrees(values) if name == "incidence" else values
    fill_further(table, chunk, normals)
    return table


def further_fields(first: MapChunk, normals: tuple[str, ...] = NORMALS) -> list[tuple[str, str]]:
    """Return the columns that are behind all else: normals, and fields of the recording."""
    fields = [] if first.normals is None else [(name, "<f4") for name in normals]
    own = None if first.attributes is None else first.attributes.dtype
    if own is not None:
        fields += [(name, own[name].newbyteorder("<").str) for name in own.names or ()]
    return fields


def fill_further(
    table: NDArray[np.void], chunk: MapChunk, normals: tuple[str, ...] = NORMALS
) -> None:
    """Put these columns of a chunk into a table; what only one of them has is left out, or stays."""
    there = set(table.dtype.names or ())
    if chunk.normals is not None and normals[0] in there:
        for axis, name in enumerate(normals):
            table[name] = chunk.normals[:, axis]
    if chunk.attributes is not None:
        for name in there.intersection(chunk.attributes.dtype.names or ()):
            table[name] = chunk.attributes[name]


def fixed_length_header(build: Callable[[int, str], str], count: int) -> bytes:
    """Header of the same length for every count, so that it can be written again at the end.

    Parameters
    ----------
    build : makes the header from the count and a filling of dots, to be put in a comment
    count : number of points
    """
    length = len(build(_LARGEST_COUNT, ""))
    return build(count, "." * (length - len(build(count, "")))).encode("ascii")
