# SPDX-License-Identifier: MIT OR Apache-2.0
"""Binary little-endian PLY maps, coordinates in double precision."""

from __future__ import annotations

from typing import ClassVar

from bentwing.map.rows_writer import RowsWriter

_TYPES = {"<f8": "double", "<f4": "float", "<u2": "ushort"}


class PlyWriter(RowsWriter):
    """Writer of PLY."""

    coordinates: ClassVar[str] = "<f8"

    def _text(self, count: int, filling: str) -> str:
        names = self._dtype.names or ()
        lines = [
            "ply",
            "format binary_little_endian 1.0",
            f"comment bentwing map, metres, z up {filling}",
            f"comment time 0 is {self.clock_origin_ns} ns UTC",
            # WKT is one line; PLY has no better place for it.
            *([f"comment crs {self.crs_wkt}"] if self.crs_wkt else []),
            f"element vertex {count}",
            *(f"property {_TYPES[self._dtype[name].str]} {name}" for name in names),
            "end_header",
            "",
        ]
        return "\n".join(lines)
