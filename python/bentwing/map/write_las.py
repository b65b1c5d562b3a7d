# SPDX-License-Identifier: MIT OR Apache-2.0
"""LAS 1.4 and LAZ maps, point format 6 with what else is known as extra dimensions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import laspy
import numpy as np
from laspy.vlrs.known import WktCoordinateSystemVlr

from bentwing.base.errors import EstimationError
from bentwing.map.compress_laz import LazBackend
from bentwing.map.gps_time import adjusted_gps_origin
from bentwing.map.writer import MapWriter, round_offset

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.map.chunk import MapChunk

SCALE = 0.0001  # m; 0.05 mm of rounding at most, 214 km in each direction of the offset
_MAX_INTENSITY = 65_535
# Type and description (32 characters at most) of what only some maps have.
_EXTRA: dict[str, tuple[type[np.generic], str]] = {
    "ring": (np.uint16, "beam number"),
    "incidence": (np.float32, "deg between beam and normal"),
    "thickness": (np.float32, "m, 1 sigma across the surface"),
    "run_id": (np.uint16, "number of the run"),
}
_ONLY_RETURN = 0x11  # return number 1 in the lower four bits, number of returns 1 in the upper


class LasWriter(MapWriter):
    """Writer of uncompressed LAS.

    Intensities are rounded to 16 bits; those of a sensor that reports shares of one (no value
    above 1 in the first chunk) are multiplied by 65,535.
    """

    compressed = False

    def __init__(self, path: Path, clock_origin_ns: int, crs_wkt: str | None = None) -> None:
        super().__init__(path, clock_origin_ns, crs_wkt)
        self._gps_origin = adjusted_gps_origin(clock_origin_ns)

    def _begin(self, first: MapChunk) -> None:
        self._header = _header(first, self.crs_wkt)
        self._intensity_scale = _intensity_scale(first)
        self._writer = laspy.LasWriter(
            self._temporary.open("wb"),
            self._header,
            do_compress=self.compressed,
            laz_backend=LazBackend(self._temporary) if self.compressed else None,
        )

    def _append(self, chunk: MapChunk) -> None:
        record = laspy.ScaleAwarePointRecord.zeros(len(chunk), header=self._header)
        table = record.array
        for axis, name in enumerate("XYZ"):
            table[name] = self._steps(chunk.points, axis)
        table["gps_time"] = self._gps_origin + chunk.times
        table["bit_fields"] = _ONLY_RETURN
        table["range"] = chunk.ranges
        if chunk.intensity is not None:
            scaled = np.nan_to_num(chunk.intensity) * self._intensity_scale
            table["intensity"] = np.clip(np.rint(scaled), 0, _MAX_INTENSITY)
        for name in _EXTRA:
            values = getattr(chunk, name)
            if values is not None and name in table.dtype.names:
                table[name] = _stored(name, values)
        if chunk.run_id is not None:
            table["point_source_id"] = chunk.run_id
        self._writer.write_points(record)

    def _steps(self, points: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
        """Whole numbers `(N,)` of `SCALE` along one axis; refuses what int32 cannot hold."""
        steps: NDArray[np.float64] = points[:, axis] - self._header.offsets[axis]
        steps /= SCALE
        np.rint(steps, out=steps)
        if len(steps) and max(steps.max(), -steps.min()) > np.iinfo(np.int32).max:
            far = points[np.argmax(np.abs(steps))].round(1).tolist()
            msg = (
                f"a map point lies at {far} m, too far for a LAS file; the trajectory has diverged"
            )
            raise EstimationError(msg)
        return steps

    def _finish(self) -> None:
        self._writer.close()

    def _abandon(self) -> None:
        self._writer.close()


class LazWriter(LasWriter):
    """Writer of compressed LAZ."""

    compressed = True


def _header(first: MapChunk, crs_wkt: str | None) -> laspy.LasHeader:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.offsets = round_offset(first.points)
    header.scales = np.full(3, SCALE)
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    header.global_encoding.wkt = True
    header.generating_software = "bentwing"
    header.system_identifier = "bentwing"
    header.add_extra_dim(laspy.ExtraBytesParams("range", np.float32, "m from the lidar"))
    for name, (kind, description) in _EXTRA.items():
        if getattr(first, name) is not None:
            header.add_extra_dim(laspy.ExtraBytesParams(name, kind, description))
    if crs_wkt is not None:
        header.vlrs.append(WktCoordinateSystemVlr(crs_wkt))
    return header


def _stored(name: str, values: NDArray[Any]) -> NDArray[Any]:
    """Values as the file has them: angles in degrees, and no digits that mean nothing.

    Such digits would be most of what a compressed point takes.
    """
    if name == "incidence":
        return np.asarray(np.rint(np.degrees(values) * 8) / 8)
    if name == "thickness":
        return np.asarray(np.rint(values * 8192) / 8192)
    return values


def _intensity_scale(first: MapChunk) -> float:
    if first.intensity is None or not len(first.intensity):
        return 1.0
    highest = float(np.nanmax(first.intensity))
    return float(_MAX_INTENSITY) if 0 < highest <= 1 else 1.0
