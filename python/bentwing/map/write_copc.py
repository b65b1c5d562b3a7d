# SPDX-License-Identifier: MIT OR Apache-2.0
"""Cloud-optimized point clouds: LAZ whose chunks are the nodes of an octree, read level by level.

Format: https://copc.io, version 1.0.
"""

from __future__ import annotations

import io
import struct
from typing import TYPE_CHECKING

import laspy
import lazrs  # type: ignore[import-untyped]
import numpy as np

from bentwing import _core
from bentwing.base.array_spool import ArraySpool
from bentwing.map.octree import GRID, Cube, Node, nodes_of
from bentwing.map.write_las import SCALE, LasWriter, begin_laz, write_again

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bentwing.map.chunk import MapChunk

_USER, _INFO, _HIERARCHY = "copc", 1, 1000
_INFO_SIZE = 160
_ENTRY = np.dtype(
    [("level", "<i4"), ("x", "<i4"), ("y", "<i4"), ("z", "<i4"), ("offset", "<u8"), ("size", "<i4"),
     ("count", "<i4")]
)  # fmt: skip
_EVLR = struct.Struct("<H16sHQ32s")
_TOGETHER = 400_000  # points whose nodes are compressed beside each other
_HELD = 2**25  # bytes of records in memory before they go to the disk
_COLUMN = "rows"


class CopcWriter(LasWriter):
    """Writer of COPC; the points wait on the disk until all are known."""

    def _begin(self, first: MapChunk) -> None:
        self._announce(first)
        self._spool = ArraySpool(self._temporary.parent, held=_HELD)

    def _put(self, rows: NDArray[np.void]) -> None:
        self._spool.add({_COLUMN: rows})

    def _finish(self) -> None:
        with self._spool, self._temporary.open("w+b") as file:
            self._write(file)

    def _abandon(self) -> None:
        self._spool.close()

    def _write(self, file: io.BufferedRandom) -> None:
        header, cube, n = self._header, self._cube(), self.n_points
        point_format = header.point_format
        laz = _core.LazCompressor(point_format.id, point_format.num_extra_bytes, own_chunks=True)
        # The description of the tree has to be the first record; it is written again at the end.
        header.vlrs.insert(0, _info(self._info(cube, (0, 0))))
        start = begin_laz(laz, file, header)
        with self.progress.stage("octree", n, "points") as shown:
            nodes = []
            for node, count in self._compressed(laz, cube, n):
                nodes.append((node, count))
                shown.advance(count)
        laz.finish()
        hierarchy = self._hierarchy(file, start, laz.record_data(), nodes)
        at = file.seek(0, io.SEEK_END)
        file.write(
            _EVLR.pack(0, _USER.encode(), _HIERARCHY, len(hierarchy), b"nodes of the octree")
        )
        file.write(hierarchy)
        header.start_of_first_evlr, header.number_of_evlrs = at, 1
        header.vlrs[0] = _info(self._info(cube, (at + _EVLR.size, len(hierarchy))))
        self._seen.say(header, n)
        write_again(header, file)

    def _cube(self) -> Cube:
        """Return what the octree fills."""
        ends = self._seen.ends
        if not len(ends):
            return Cube.around(np.zeros(3, np.int64), np.zeros(3, np.int64))
        low, high = np.stack([ends[axis] for axis in "XYZ"], axis=1).astype(np.int64)
        return Cube.around(low, high)

    def _compressed(
        self, laz: _core.LazCompressor, cube: Cube, n_points: int
    ) -> Iterator[tuple[Node, int]]:
        """Write the nodes, some at a time; yield each with its number of points."""
        waiting: list[NDArray[np.void]] = []

        def flush() -> None:
            if waiting:
                rows = np.concatenate(waiting)
                laz.compress_chunks(rows.view(np.uint8), [len(part) for part in waiting])
                waiting.clear()

        if not n_points:
            yield Node(0, 0, 0, 0), 0
            return
        folder = self._temporary.parent
        for node, rows in nodes_of(self._parts, n_points, cube, folder):
            waiting.append(rows)
            if sum(map(len, waiting)) >= _TOGETHER:
                flush()
            yield node, len(rows)
        flush()

    def _parts(self) -> Iterator[NDArray[np.void]]:
        return (table[_COLUMN] for table in self._spool.tables())

    def _hierarchy(
        self, file: io.BufferedRandom, start: int, record: bytes, nodes: list[tuple[Node, int]]
    ) -> bytes:
        """Return what says where each node is: one page."""
        table = np.zeros(len(nodes), _ENTRY)
        for entry, (node, count) in zip(table, nodes, strict=True):
            entry["level"], entry["x"], entry["y"], entry["z"] = node
            entry["count"] = count
        if self.n_points:
            file.seek(start)
            chunks = lazrs.read_chunk_table(file, lazrs.LazVlr(record))
            table["size"] = [n_bytes for _, n_bytes in chunks]
            # the chunks begin behind the place of their table
            ends = np.cumsum(table["size"].astype(np.uint64)) + np.uint64(start + 8)
            table["offset"] = ends - table["size"].astype(np.uint64)
        # from the root downwards, as readers go through it
        return bytes(table[np.argsort(table["level"], kind="stable")].tobytes())

    def _info(self, cube: Cube, page: tuple[int, int]) -> bytes:
        """Return the description of the tree; `page` is where its nodes are listed, and how long that is."""
        edge = cube.edge * SCALE
        centre = self._header.offsets + cube.low * SCALE + 0.5 * edge
        times = self._seen.ends["gps_time"] if self.n_points else (0.0, 0.0)
        packed = struct.pack("<5d2Q2d", *centre, 0.5 * edge, edge / GRID, *page, *times)
        return packed.ljust(_INFO_SIZE, b"\0")


def _info(data: bytes) -> laspy.VLR:
    return laspy.VLR(_USER, _INFO, "description of the octree", data)
