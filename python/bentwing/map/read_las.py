# SPDX-License-Identifier: MIT OR Apache-2.0
"""Points of LAS and LAZ files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import laspy
import numpy as np

from bentwing.base.errors import InputError
from bentwing.map.las_bounds import require_sound_las
from bentwing.map.read_rows import PART

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.map.read_rows import Table


def las_points(path: Path) -> Iterator[Table]:
    """Read coordinates and times part by part."""
    require_sound_las(path)
    with laspy.open(path) as file:
        has_times = "gps_time" in file.header.point_format.dimension_names
        n = 0
        for part in file.chunk_iterator(PART):
            n += len(part)
            points = np.stack([part.x, part.y, part.z], axis=1).astype(np.float64)
            yield points, np.array(part.gps_time, np.float64) if has_times else None
        if n != file.header.point_count:
            msg = f"{path}: announces {file.header.point_count} points, holds {n}; it is truncated"
            raise InputError(msg)


def las_column(path: Path, name: str) -> Iterator[NDArray[Any]]:
    """Read a column of the points, in the parts of `las_points`; none where the file does not have it."""
    require_sound_las(path)
    with laspy.open(path) as file:
        if name in file.header.point_format.dimension_names:
            for part in file.chunk_iterator(PART):
                yield np.array(part[name])
