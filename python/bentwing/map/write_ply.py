# SPDX-License-Identifier: MIT OR Apache-2.0
"""Binary little-endian PLY maps, coordinates in double precision."""

from __future__ import annotations

from typing import ClassVar

from bentwing.map.rows_writer import RowsWriter

# Eight bytes long there are no whole numbers.
_TYPES = {
    "<f8": "double", "<f4": "float", "|u1": "uchar", "|i1": "char", "<u2": "ushort", "<i2": "short",
    "<u4": "uint", "<i4": "int",
}  # fmt: skip


class PlyWriter(RowsWriter):
    """Writer of PLY."""

    coordinates: ClassVar[str] = "<f8"
    normals: ClassVar[tuple[str, ...]] = ("nx", "ny", "nz")

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
