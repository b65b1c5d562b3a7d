# SPDX-License-Identifier: MIT OR Apache-2.0
"""A copy of a map with the classes of its points and their height above ground."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

import laspy
import numpy as np

from bentwing.base.atomic import atomic_path
from bentwing.base.gps_time import adjusted_gps_origin
from bentwing.map.las_bounds import require_sound_las
from bentwing.map.read_rows import PART
from bentwing.map.write_las import SCALE
from bentwing.products.ground import BAND

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from bentwing.products.finished_map import FinishedMap
    from bentwing.products.ground import Terrain

UNCLASSIFIED, GROUND = 1, 2
_HEIGHT = laspy.ExtraBytesParams("height", np.float32, "m above ground")


def write_classified(source: FinishedMap, terrain: Terrain, out: Path) -> None:
    """Write the map as LAS or LAZ, with all that it has.

    Parameters
    ----------
    terrain : in the coordinates of the source
    """
    with atomic_path(out) as temporary:
        parts = (
            _las_parts(source) if source.path.suffix in {".laz", ".las"} else _other_parts(source)
        )
        header = next(parts)
        assert isinstance(header, laspy.LasHeader)
        with laspy.open(
            temporary, "w", header=header, do_compress=out.suffix.lower() == ".laz", closefd=True
        ) as writer:
            for record in parts:
                points = np.stack([record.x, record.y, record.z], axis=1) - source.origin
                height = points[:, 2] - terrain.height_at(points[:, :2])
                record.classification = np.where(np.abs(height) <= BAND, GROUND, UNCLASSIFIED)
                record["height"] = height.astype(np.float32)
                writer.write_points(record)


def _las_parts(source: FinishedMap) -> Iterator[laspy.LasHeader | laspy.ScaleAwarePointRecord]:
    """Yield the header with the new dimension, and then records with all that the map has."""
    require_sound_las(source.path)
    with laspy.open(source.path) as reader:
        header = copy.deepcopy(reader.header)
        header.vlrs = [record for record in header.vlrs if record.record_id != 22204]  # of LAZ
        header.add_extra_dim(_HEIGHT)
        yield header
        for part in reader.chunk_iterator(PART):
            record = laspy.ScaleAwarePointRecord.zeros(len(part), header=header)
            for name in part.array.dtype.names or ():
                record.array[name] = part.array[name]
            yield record


def _other_parts(source: FinishedMap) -> Iterator[laspy.LasHeader | laspy.ScaleAwarePointRecord]:
    """Yield a header, and then records of the coordinates and times of a map in another format."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.offsets, header.scales = source.origin, np.full(3, SCALE)
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    header.add_extra_dim(_HEIGHT)
    yield header
    begin = adjusted_gps_origin(source.run.start_ns)
    for part in source.parts():
        record = laspy.ScaleAwarePointRecord.zeros(len(part.points), header=header)
        record.x, record.y, record.z = (part.points + source.origin).T
        if part.times is not None:
            record.gps_time = part.times + begin
        yield record
