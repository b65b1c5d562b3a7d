# SPDX-License-Identifier: MIT OR Apache-2.0
"""The map of a finished run, or of runs that were merged, with the ways of its sensors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.clock import NS_PER_S
from bentwing.base.errors import InputError
from bentwing.base.run_record import understood
from bentwing.map.epsg import epsg_of_map
from bentwing.map.finished_run import FinishedRun
from bentwing.map.read import MapPart

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.map.chunk import MapChunk

_ROUND = 100.0  # m, of the place that coordinates are relative to
_STAMPS = 1e-6  # s; those of files are rounded


@dataclass(frozen=True, slots=True)
class FinishedMap:
    """A map that is read part by part, as often as needed.

    Coordinates are relative to a round place nearby, because projected ones are too large for voxels.

    Attributes
    ----------
    run : as its folder holds it
    path : file of the map
    origin : (3,) m, of the coordinates used here in those of the file; its height is zero
    epsg : of the file's coordinates; None where they are the run's own
    ways : of the sensors, one for each run, in the coordinates used here; empty where there is none
    """

    run: FinishedRun
    path: Path
    origin: NDArray[np.float64]
    epsg: int | None
    ways: tuple[Trajectory, ...]

    def parts(self) -> Iterator[MapPart]:
        """Read points, and times in s since the recording's start where the file has any."""
        for part in self.run.parts():
            yield MapPart(part.points - self.origin, part.times)

    def sensors_at(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return where the sensor was (N, 3) m; NaN where no way says so, or two of them do."""
        found = np.full((len(times), 3), np.nan)
        n_ways = np.zeros(len(times), np.intp)
        for way in self.ways:
            covered = (times >= way.times[0] - _STAMPS) & (times <= way.times[-1] + _STAMPS)
            n_ways += covered
            for axis in range(3):
                found[covered, axis] = np.interp(times[covered], way.times, way.positions[:, axis])
        found[n_ways != 1] = np.nan
        return found

    def beams_of(self, chunk: MapChunk) -> NDArray[np.float64]:
        """Return the unit directions (N, 3) from the sensor to the points of a chunk; NaN as `sensors_at`."""
        beams = chunk.points - self.sensors_at(chunk.times)
        beams /= np.maximum(np.linalg.norm(beams, axis=1, keepdims=True), 1e-9)
        return beams


def open_map_of(folder: Path | str) -> FinishedMap:
    """Open the map of a run folder.

    Raises
    ------
    UsageError
        If the folder holds no run, one that is not complete, or several separate maps.
    InputError
        If it has no map, an empty one, or a file is not the one that the run wrote.
    """
    run = FinishedRun.open(folder)
    path = run.require_map()
    first = next((part.points for part in run.parts() if len(part.points)), None)
    if first is None:
        msg = f"{path}: holds no point; give a run with a map"
        raise InputError(msg)
    origin = np.round(np.median(first, axis=0) / _ROUND) * _ROUND * [1.0, 1.0, 0.0]
    with understood(run.folder):
        return FinishedMap(run, path, origin, epsg_of_map(path), _ways_of(run, origin))


def _ways_of(run: FinishedRun, origin: NDArray[np.float64]) -> tuple[Trajectory, ...]:
    """Return the trajectories in the coordinates of the map, less the origin, on its clock."""
    linear = (run.record.get("georeference") or {}).get("linear")
    moved = []
    for flight in run.flights:
        way, late = flight.trajectory, (flight.start_ns - run.start_ns) / NS_PER_S
        positions = way.positions
        if linear:
            local = positions - np.array(linear["map"])
            positions = local @ np.array(linear["matrix"]).T + np.array(linear["projected"])
        if len(way):
            moved.append(replace(way, times=way.times + late, positions=positions - origin))
    return tuple(moved)
