# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether the chunks of a LAZ file can be what they say: decoders make room for it.

Format: https://github.com/LASzip/LASzip. The first eight bytes of the points lead to a table with the
number of points and bytes of each chunk. A chunk of the point formats from 6 on begins with its first
point, the number of its points, and the sizes of its layers.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, BinaryIO

import lazrs  # type: ignore[import-untyped]

if TYPE_CHECKING:
    from collections.abc import Sequence

_ITEMS = 32  # bytes before the number of items in the record
_LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}  # of an item by its type
_EXTRA_BYTES = 14  # a layer for each
_TABLE = "a table of chunks"
_SIZES = "chunks of other sizes"


def problem_of_chunks(
    file: BinaryIO, vlr: lazrs.LazVlr, span: tuple[int, int], n_points: int
) -> str | None:
    """Return what the file announces and cannot hold, None if it can hold all.

    Parameters
    ----------
    vlr : how the points are compressed
    span : where the points begin, and the size of the file, bytes
    n_points : in all chunks
    """
    start, size = span
    table = _int64(file, start)
    if table == -1:  # written as a stream: it stands at the end
        table = _int64(file, size - 8)
    if not start + 8 <= table <= size - 8:
        return _TABLE
    file.seek(table)
    version, n_chunks = struct.unpack("<II", file.read(8))
    # A chunk holds a point at least, and takes a byte at least.
    if version != 0 or n_chunks > min(n_points, table - start):
        return _TABLE
    file.seek(start)
    chunks = lazrs.read_chunk_table(file, vlr)
    if not chunks or sum(n_bytes for _, n_bytes in chunks) != table - start - 8:
        return _SIZES
    most = sum(n for n, _ in chunks)
    least = most if vlr.uses_variable_size_chunks() else most - chunks[-1][0] + 1
    if not least <= n_points <= most:
        return _SIZES
    return _SIZES if _has_wide_layers(file, vlr, start + 8, chunks) else None


def _has_wide_layers(
    file: BinaryIO, vlr: lazrs.LazVlr, at: int, chunks: Sequence[tuple[int, int]]
) -> bool:
    """Whether the layers of a chunk are larger than the chunk."""
    n_layers = _n_layers(bytes(vlr.record_data()))
    if not n_layers:
        return False
    begin = vlr.item_size() + 4
    for _, n_bytes in chunks:
        file.seek(at + begin)
        sizes = struct.unpack(f"<{n_layers}I", file.read(4 * n_layers).ljust(4 * n_layers, b"\xff"))
        if begin + 4 * n_layers + sum(sizes) > n_bytes:
            return True
        at += n_bytes
    return False


def _n_layers(record: bytes) -> int:
    (n_items,) = struct.unpack_from("<H", record, _ITEMS)
    items = [struct.unpack_from("<HHH", record, _ITEMS + 2 + 6 * i) for i in range(n_items)]
    return sum(size if kind == _EXTRA_BYTES else _LAYERS.get(kind, 0) for kind, size, _ in items)


def _int64(file: BinaryIO, at: int) -> int:
    file.seek(at)
    (value,) = struct.unpack("<q", file.read(8).ljust(8, b"\0"))
    return int(value)
