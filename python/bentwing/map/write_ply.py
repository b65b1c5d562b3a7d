# SPDX-License-Identifier: MIT OR Apache-2.0
"""Binary little-endian PLY maps, coordinates in double precision."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.map.columns import fixed_length_header, row_type, rows
from bentwing.map.writer import MapWriter

if TYPE_CHECKING:
    from bentwing.map.chunk import MapChunk

_TYPES = {"<f8": "double", "<f4": "float", "<u2": "ushort"}


class PlyWriter(MapWriter):
    """Writer of PLY; `time` is in s since the recording's start, whose stamp is in a comment."""

    def _begin(self, first: MapChunk) -> None:
        self._dtype = row_type(first, "<f8")
        self._file = self._temporary.open("wb")
        self._file.write(self._header())

    def _append(self, chunk: MapChunk) -> None:
        self._file.write(rows(chunk, self._dtype).tobytes())

    def _finish(self) -> None:
        self._file.seek(0)
        self._file.write(self._header())
        self._file.close()

    def _abandon(self) -> None:
        self._file.close()

    def _header(self) -> bytes:
        names = self._dtype.names or ()
        properties = [f"property {_TYPES[self._dtype[name].str]} {name}" for name in names]

        # WKT is one line; PLY has no better place for it.
        crs = [f"comment crs {self.crs_wkt}"] if self.crs_wkt else []

        def build(count: int, filling: str) -> str:
            lines = [
                "ply",
                "format binary_little_endian 1.0",
                f"comment bentwing map, metres, z up {filling}",
                f"comment time 0 is {self.clock_origin_ns} ns UTC",
                *crs,
                f"element vertex {count}",
                *properties,
                "end_header",
                "",
            ]
            return "\n".join(lines)

        return fixed_length_header(build, self.n_points)
