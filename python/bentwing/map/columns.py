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


def row_type(first: MapChunk, coordinate: str) -> np.dtype[np.void]:
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
    return np.dtype(fields)


def rows(chunk: MapChunk, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """Rows `(N,)` of a chunk; what it does not have is zero."""
    table = np.zeros(len(chunk), dtype)
    for axis, name in enumerate("xyz"):
        table[name] = chunk.points[:, axis]
    table["time"], table["range"] = chunk.times, chunk.ranges
    for name in _OPTIONAL:
        values = getattr(chunk, name)
        if values is not None and name in (dtype.names or ()):
            table[name] = np.degrees(values) if name == "incidence" else values
    return table


def fixed_length_header(build: Callable[[int, str], str], count: int) -> bytes:
    """Header of the same length for every count, so that it can be written again at the end.

    Parameters
    ----------
    build : makes the header from the count and a filling of dots, to be put in a comment
    count : number of points
    """
    length = len(build(_LARGEST_COUNT, ""))
    return build(count, "." * (length - len(build(count, "")))).encode("ascii")
