# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a run folder holds, read back as a viewer needs it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.run_record import finished_record, understood
from bentwing.evaluate.surfels import Surfels, surfels_of_cloud
from bentwing.map.gps_time import adjusted_gps_origin
from bentwing.map.read import read_parts
from bentwing.report.finished import map_of, trajectory_of
from bentwing.report.view.levels import FINEST, Level, LevelPoints, coarser_levels

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.progress import Stage
    from bentwing.base.trajectory import Trajectory

SURFEL_EDGE = 0.4
"""m, of the surfels that are shown, the finest level of the estimator."""
MOST_SURFELS = 200_000
_N_COARSER = 2


@dataclass(frozen=True, slots=True)
class Contents:
    """A run, with times in s since the recording's start.

    Attributes
    ----------
    levels : the map, finest first
    surfels : of the map
    trajectory : of the IMU
    windows : records of the estimate
    """

    levels: list[LevelPoints]
    surfels: Surfels
    trajectory: Trajectory
    windows: list[dict[str, Any]]


def read_contents(folder: Path, most: int, shown: Stage) -> Contents:
    """Read a run folder.

    Parameters
    ----------
    folder : that `bentwing map` has written
    most : points of the finest level
    shown : advanced by the points read

    Raises
    ------
    UsageError
        If it is no run folder, or the run is not complete.
    InputError
        If its trajectory or its map cannot be read.
    """
    record = finished_record(folder)
    with understood(folder):
        # Of a merged map the path of the first run is shown.
        first = (record.get("runs") or [record])[0]
        trajectory, origin_ns = trajectory_of(
            folder / first.get("trajectory", "trajectory.txt"), first
        )
    finest = Level(FINEST, most)
    surfels = surfels_of_cloud(
        _watched(map_of(folder), record, origin_ns, finest, shown), SURFEL_EDGE
    )
    levels = [finest.result, *coarser_levels(finest.result, _N_COARSER)]
    return Contents(levels, surfels, trajectory, record.get("windows") or [])


def _watched(
    path: Path | None, record: dict[str, Any], origin_ns: int, level: Level, shown: Stage
) -> Iterator[NDArray[np.float64]]:
    """Pass the points of a map on, adding them to a level."""
    if path is None:
        return
    for part in read_parts(path, record.get("georeference")):
        times = np.zeros(len(part.points)) if part.times is None else part.times
        if path.suffix in {".laz", ".las"}:
            times = times - adjusted_gps_origin(origin_ns)
        level.add(part.points, times)
        shown.advance(len(part.points))
        yield part.points
