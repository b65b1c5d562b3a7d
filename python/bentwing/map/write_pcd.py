# SPDX-License-Identifier: MIT OR Apache-2.0
"""Binary PCD 0.7 maps, coordinates in single precision as PCL reads them.

Geographic coordinates would lose their decimetres, so they are relative to an offset in a comment.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bentwing.map.columns import fixed_length_header, row_type, rows
from bentwing.map.read_rows import PCD_OFFSET
from bentwing.map.writer import MapWriter, round_offset

if TYPE_CHECKING:
    from bentwing.map.chunk import MapChunk


class PcdWriter(MapWriter):
    """Writer of PCD; `time` is in s since the recording's start, whose stamp is in a comment."""

    def _begin(self, first: MapChunk) -> None:
        self._dtype = row_type(first, "<f4")
        self._offset = round_offset(first.points)
        self._file = self._temporary.open("wb")
        self._file.write(self._header())

    def _append(self, chunk: MapChunk) -> None:
        near = replace(chunk, points=chunk.points - self._offset)
        self._file.write(rows(near, self._dtype).tobytes())

    def _finish(self) -> None:
        self._file.seek(0)
        self._file.write(self._header())
        self._file.close()

    def _abandon(self) -> None:
        self._file.close()

    def _header(self) -> bytes:
        names = self._dtype.names or ()
        types = [self._dtype[name] for name in names]

        crs = []
        if self._offset.any():
            crs.append(" ".join([PCD_OFFSET, *(f"{value:.0f}" for value in self._offset)]))
        if self.crs_wkt:
            crs.append(f"# crs {self.crs_wkt}")

        def build(count: int, filling: str) -> str:
            lines = [
                "# .PCD v0.7 - Point Cloud Data file format",
                f"# bentwing map, metres, z up {filling}",
                f"# time 0 is {self.clock_origin_ns} ns UTC",
                *crs,
                "VERSION 0.7",
                f"FIELDS {' '.join(names)}",
                f"SIZE {' '.join(str(kind.itemsize) for kind in types)}",
                f"TYPE {' '.join(kind.kind.upper() for kind in types)}",
                f"COUNT {' '.join('1' for _ in types)}",
                f"WIDTH {count}",
                "HEIGHT 1",
                "VIEWPOINT 0 0 0 1 0 0 0",
                f"POINTS {count}",
                "DATA binary",
                "",
            ]
            return "\n".join(lines)

        return fixed_length_header(build, self.n_points)
