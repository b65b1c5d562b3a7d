# SPDX-License-Identifier: MIT OR Apache-2.0
"""LAS 1.4 and LAZ maps, point format 6 with what else is known as extra dimensions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import laspy
import numpy as np
from laspy.vlrs.known import LasZipVlr, WktCoordinateSystemVlr

from bentwing import _core
from bentwing.base.gps_time import adjusted_gps_origin
from bentwing.map.columns import NORMALS, fill_further, further_fields
from bentwing.map.writer import MapWriter, round_offset

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from bentwing.map.chunk import MapChunk

SCALE = 0.0001  # m; 0.05 mm of rounding at most, 214 km in each direction of the offset
_MAX_INTENSITY = 65_535
# Type and description (32 characters at most) of what only some maps have.
EXTRA: dict[str, tuple[type[np.generic], str]] = {
    "ring": (np.uint16, "beam number"),
    "incidence": (np.float32, "deg between beam and normal"),
    "thickness": (np.float32, "m, 1 sigma across the surface"),
    "shift": (np.float32, "m moved along the beam"),
    "sigma": (np.float32, "m, 1 sigma along the beam"),
    "run_id": (np.uint16, "number of the run"),
}
_NORMALS = {
    name: f"of the surface, {axis}, to the lidar" for axis, name in zip("xyz", NORMALS, strict=True)
}
# Normals are stored in steps of 0.03 degrees: further digits mean nothing, and do not compress.
_STEPS = 2048.0
# What the records are made of beside the points.
_COLUMNS: dict[str, type[np.generic]] = {
    "times": np.float64,
    "ranges": np.float32,
    "intensity": np.float32,
    **{name: kind for name, (kind, _) in EXTRA.items()},
}


class LasWriter(MapWriter):
    """Writer of uncompressed LAS.

    Intensities are rounded to 16 bits; those of a sensor that reports shares of one (no value
    above 1 in the first chunk) are multiplied by 65,535.
    """

    def __init__(self, path: Path, clock_origin_ns: int, crs_wkt: str | None = None) -> None:
        super().__init__(path, clock_origin_ns, crs_wkt)
        self._gps_origin = adjusted_gps_origin(clock_origin_ns)
        self._seen = _Seen()

    def _begin(self, first: MapChunk) -> None:
        self._announce(first)
        self._file = self._temporary.open("wb")
        self._header.write_to(self._file)

    def _announce(self, first: MapChunk) -> None:
        """Decide what the records have."""
        self._header = _header(first, self.crs_wkt)
        self._further = np.dtype(further_fields(first))
        self._intensity_scale = _intensity_scale(first)

    def _append(self, chunk: MapChunk) -> None:
        if len(chunk):
            rows = self._records(chunk)
            self._seen.add(rows, self._header.point_format.extra_dimension_names)
            self._put(rows)

    def _put(self, rows: NDArray[np.void]) -> None:
        self._file.write(rows.data)

    def _records(self, chunk: MapChunk) -> NDArray[np.void]:
        """Return the records (N,) of a chunk as the file has them."""
        point_format = self._header.point_format
        columns: dict[str, Any] = {
            name: _column(chunk, name, kind) for name, kind in _COLUMNS.items()
        }
        records = _core.las_records(
            np.ascontiguousarray(chunk.points),
            stored=[name for name in EXTRA if name in point_format.dimension_names],
            offsets=tuple(self._header.offsets.tolist()),
            step=SCALE,
            gps_origin=self._gps_origin,
            intensity_scale=self._intensity_scale,
            **columns,
        )
        if self._further.names:
            further = _further(chunk, self._further)
            own = records.reshape(len(chunk), -1)
            records = np.hstack([own, further.view(np.uint8).reshape(len(chunk), -1)]).reshape(-1)
        table: NDArray[np.void] = records.view(point_format.dtype())
        return table

    def _finish(self) -> None:
        with self._file:
            self._seen.say(self._header, self.n_points)
            write_again(self._header, self._file)

    def _abandon(self) -> None:
        self._file.close()


class LazWriter(LasWriter):
    """Writer of compressed LAZ."""

    def _begin(self, first: MapChunk) -> None:
        self._announce(first)
        point_format = self._header.point_format
        self._laz = _core.LazCompressor(point_format.id, point_format.num_extra_bytes)
        self._file = self._temporary.open("wb")
        begin_laz(self._laz, self._file, self._header)

    def _put(self, rows: NDArray[np.void]) -> None:
        self._laz.compress(rows.view(np.uint8))

    def _finish(self) -> None:
        self._laz.finish()
        super()._finish()


class _Seen:
    """Between which ends the numbers of the records are.

    Attributes
    ----------
    ends : (2,) records with the least and the greatest of each number; (0,) before there are any
    """

    def __init__(self) -> None:
        self.ends = np.empty(0, np.void)

    def add(self, rows: NDArray[np.void], extra: Iterable[str]) -> None:
        """Take records (N,), at least one, with extra dimensions of these names."""
        names = ("X", "Y", "Z", "gps_time", *extra)
        ends = _ends_of(rows, names)
        known = [self.ends, ends] if len(self.ends) else [ends]
        self.ends = _ends_of(np.concatenate(known), names)

    def say(self, header: laspy.LasHeader, n_points: int) -> None:
        """Write it into a header; laspy looks at the two ends in place of all records."""
        header.update(laspy.PackedPointRecord(self.ends[:1], header.point_format))
        if n_points:  # one by one, as of extra dimensions laspy sees the first record alone
            header.grow(laspy.PackedPointRecord(self.ends[1:], header.point_format))
        header.point_count = n_points
        header.number_of_points_by_return[0] = n_points


def _ends_of(rows: NDArray[np.void], names: Iterable[str]) -> NDArray[np.void]:
    ends = np.zeros(2, rows.dtype)
    for name in names:
        values = np.ascontiguousarray(rows[name])
        # what is not a number is no end, save where there is nothing else
        ends[name] = np.fmin.reduce(values), np.fmax.reduce(values)
    return ends


def begin_laz(laz: _core.LazCompressor, file: BinaryIO, header: laspy.LasHeader) -> int:
    """Write the header of a compressed file; return where its points begin."""
    header.vlrs.append(LasZipVlr(laz.record_data()))
    header.are_points_compressed = True
    header.write_to(file)
    file.flush()
    start = file.tell()
    laz.begin(Path(file.name), start)
    return start


def write_again(header: laspy.LasHeader, file: BinaryIO) -> None:
    """Write what the header says now over what it said at the beginning of the file."""
    file.seek(0)
    header.write_to(file, ensure_same_size=True)


def _header(first: MapChunk, crs_wkt: str | None) -> laspy.LasHeader:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.offsets = round_offset(first.points)
    header.scales = np.full(3, SCALE)
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    header.global_encoding.wkt = True
    header.generating_software = "bentwing"
    header.system_identifier = "bentwing"
    header.add_extra_dim(laspy.ExtraBytesParams("range", np.float32, "m from the lidar"))
    for name, (kind, description) in EXTRA.items():
        if getattr(first, name) is not None:
            header.add_extra_dim(laspy.ExtraBytesParams(name, kind, description))
    for name, type_ in further_fields(first):
        header.add_extra_dim(laspy.ExtraBytesParams(name, type_, _NORMALS.get(name, "")))
    if crs_wkt is not None:
        header.vlrs.append(WktCoordinateSystemVlr(crs_wkt))
    return header


def _further(chunk: MapChunk, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """Return what the records (N,) have behind all that every map may have."""
    table = np.zeros(len(chunk), dtype)
    fill_further(table, chunk)
    for name in _NORMALS.keys() & set(dtype.names or ()):
        table[name] = np.rint(table[name] * _STEPS) / _STEPS
    return table


def _column(chunk: MapChunk, name: str, kind: type[np.generic]) -> NDArray[Any] | None:
    values = getattr(chunk, name)
    return None if values is None else np.ascontiguousarray(values, kind)


def _intensity_scale(first: MapChunk) -> float:
    if first.intensity is None or not len(first.intensity):
        return 1.0
    highest = float(np.nanmax(first.intensity))
    return float(_MAX_INTENSITY) if 0 < highest <= 1 else 1.0
