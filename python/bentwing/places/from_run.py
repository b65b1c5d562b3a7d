# SPDX-License-Identifier: MIT OR Apache-2.0
"""Places of what lies on the disk: run folders, and clouds of other scanners."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bentwing.errors import UsageError
from bentwing.map.gps_time import adjusted_gps_origin
from bentwing.map.read import MAP_SUFFIXES, read_parts, read_points
from bentwing.places.cut import describe_run
from bentwing.run_folder import read_record
from bentwing.trajectory import Trajectory, read_tum

if TYPE_CHECKING:
    from bentwing.places.place import Place
    from bentwing.places.settings import PlaceSettings


def places_of_run(folder: Path, settings: PlaceSettings | None = None) -> list[Place]:
    """Describe the places of a run folder: its map's points, and its trajectory.

    Raises
    ------
    UsageError
        If the folder holds no run, or the run has no map.
    InputError
        If its trajectory or its map cannot be read, or the map has no times.
    """
    folder = Path(folder)
    begin = float((read_record(folder).get("segments") or [[0.0]])[0][0])
    path = next((p for s in MAP_SUFFIXES if (p := folder / f"map{s}").exists()), None)
    if path is None:
        msg = f"{folder}: the run has no map; run `bentwing map` again, to its end"
        raise UsageError(msg)
    absolute, first_ns = read_tum(folder / "trajectory.txt")
    trajectory = Trajectory(absolute.times + begin, absolute.positions, absolute.quats_xyzw)
    is_las = path.suffix in {".laz", ".las"}
    origin = adjusted_gps_origin(first_ns - round(begin * 1e9)) if is_las else 0.0
    points, times = [], []
    for part in read_parts(path, read_record(folder).get("georeference")):
        if part.times is None:
            return describe_run(read_points(path), settings=settings)
        points.append(part.points)
        times.append(part.times - origin)
    return describe_run(np.concatenate(points), np.concatenate(times), trajectory, settings)


def places_of_cloud(path: Path, settings: PlaceSettings | None = None) -> list[Place]:
    """Describe the places of a gravity-aligned cloud without a run: the whole of it, or tiles.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    points = read_points(Path(path))
    return describe_run(points[np.isfinite(points).all(axis=1)], settings=settings)
