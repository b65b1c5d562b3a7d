# SPDX-License-Identifier: MIT OR Apache-2.0
"""Binary PCD 0.7 maps, coordinates in single precision as PCL reads them.

Geographic coordinates would lose their decimetres, so they are relative to an offset in a comment.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

from bentwing.map.read_rows import PCD_OFFSET
from bentwing.map.rows_writer import RowsWriter
from bentwing.map.writer import round_offset

if TYPE_CHECKING:
    from bentwing.map.chunk import MapChunk


class PcdWriter(RowsWriter):
    """Writer of PCD."""

    coordinates: ClassVar[str] = "<f4"

    def _begin(self, first: MapChunk) -> None:
        self._offset = round_offset(first.points)
        super()._begin(first)

    def _append(self, chunk: MapChunk) -> None:
        super()._append(replace(chunk, points=chunk.points - self._offset))

    def _text(self, count: int, filling: str) -> str:
        names = self._dtype.names or ()
        types = [self._dtype[name] for name in names]
        crs = []
        if self._offset.any():
            crs.append(" ".join([PCD_OFFSET, *(f"{value:.0f}" for value in self._offset)]))
        if self.crs_wkt:
            crs.append(f"# crs {self.crs_wkt}")
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
