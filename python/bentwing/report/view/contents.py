# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a run folder holds, read back as a viewer needs it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bentwing.evaluate.surfels import Surfels, surfels_of_cloud
from bentwing.report.finished import ShownRun
from bentwing.report.view.levels import FINEST, Level, LevelPoints, coarser_levels

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import numpy as np
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
    shown_run = ShownRun.open(folder)
    finest = Level(FINEST, most)
    surfels = surfels_of_cloud(_watched(shown_run, finest, shown), SURFEL_EDGE)
    levels = [finest.result, *coarser_levels(finest.result, _N_COARSER)]
    windows = shown_run.run.record.get("windows") or []
    return Contents(levels, surfels, shown_run.trajectory, windows)


def _watched(run: ShownRun, level: Level, shown: Stage) -> Iterator[NDArray[np.float64]]:
    """Pass the points of a map on, adding them to a level."""
    run.run.require_one_map()
    for points, times in run.parts() if run.run.map_path is not None else ():
        level.add(points, times)
        shown.advance(len(points))
        yield points
