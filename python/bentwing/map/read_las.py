# SPDX-License-Identifier: MIT OR Apache-2.0
"""Points of LAS and LAZ files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import laspy
import numpy as np
from laspy import DecompressionSelection

from bentwing.base.errors import InputError
from bentwing.map.las_bounds import require_sound_las
from bentwing.map.read_rows import PART

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.map.read_rows import Table

# Of a compressed file only what is asked for is decoded: that takes half the time.
_PLACES = DecompressionSelection.XY_RETURNS_CHANNEL | DecompressionSelection.Z
_TIMES = DecompressionSelection.GPS_TIME
_COLUMNS = DecompressionSelection.INTENSITY | DecompressionSelection.ALL_EXTRA_BYTES


def las_points(path: Path) -> Iterator[Table]:
    """Read coordinates and times part by part."""
    require_sound_las(path)
    with laspy.open(path, decompression_selection=_PLACES | _TIMES) as file:
        has_times = "gps_time" in file.header.point_format.dimension_names
        n = 0
        for part in file.chunk_iterator(PART):
            n += len(part)
            points = np.stack([part.x, part.y, part.z], axis=1).astype(np.float64)
            yield points, np.array(part.gps_time, np.float64) if has_times else None
        if n != file.header.point_count:
            msg = f"{path}: announces {file.header.point_count} points, holds {n}; it is truncated"
            raise InputError(msg)


def las_columns(path: Path, missing: Mapping[str, float]) -> Iterator[list[NDArray[Any]]]:
    """Read the intensity or extra columns of the points, in the parts of `las_points`.

    Parameters
    ----------
    path : the file
    missing : the names of the columns, each with the value of one that the file does not have
    """
    require_sound_las(path)
    with laspy.open(path, decompression_selection=_COLUMNS) as file:
        there = set(file.header.point_format.dimension_names)
        for part in file.chunk_iterator(PART):
            yield [
                np.array(part[name]) if name in there else np.full(len(part), value)
                for name, value in missing.items()
            ]
