# SPDX-License-Identifier: MIT OR Apache-2.0
"""Places of what lies on the disk: run folders, and clouds of other scanners."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import InputError, UsageError
from bentwing.base.gps_time import adjusted_gps_origin
from bentwing.base.trajectory import Trajectory
from bentwing.closing.places.cut import describe_parts
from bentwing.closing.places.settings import PlaceSettings
from bentwing.closing.places.stream import PartStream
from bentwing.closing.places.tiles import tiled
from bentwing.map.finished_run import FinishedRun
from bentwing.map.read import read_parts

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    from bentwing.closing.places.place import Place


_PAUSE = 60.0  # s, between runs that were merged, whenever they were recorded


@dataclass(frozen=True, slots=True)
class RunMap:
    """The map of a run folder, and the way it was seen from; merged runs count as if they had followed each other.

    Attributes
    ----------
    path : of the map's file
    trajectory : of all flights
    segments : first and last time of each stretch of it without a break, s
    georeference : of the map's coordinates, as run.json has it
    """

    path: Path
    trajectory: Trajectory
    segments: list[tuple[float, float]]
    georeference: Mapping[str, Any] | None
    _origins: NDArray[np.float64]

    def parts(self) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64] | None]]:
        """Points (N, 3) m, map frame, and their times (N,) on the clock of the trajectory if the map has any.

        Raises
        ------
        InputError
            If the map cannot be read.
        """
        from bentwing.map.read_las import las_columns  # laspy is slow to import

        runs = las_columns(self.path, {"run_id": 0}) if len(self._origins) > 1 else iter(())
        for part in read_parts(self.path, self.georeference):
            if part.times is None:
                yield part.points, None
            else:
                yield part.points, part.times - self._origins[next(runs, [0])[0]]


def map_of_run(folder: Path) -> RunMap:
    """Find the map of a run folder.

    Raises
    ------
    UsageError
        If the folder holds no run, or the run has no map, or one of merged runs that does not say which
        run a point is of.
    InputError
        If a trajectory cannot be read.
    """
    run = FinishedRun.open(folder)
    run.require_one_map()
    path = run.map_path
    if path is None:
        msg = f"{folder}: the run has no map; run `bentwing map` again, to its end and without --no-map"
        raise UsageError(msg)
    is_las = path.suffix in {".laz", ".las"}
    if len(run.flights) > 1 and not is_las:
        msg = f"{path}: does not say of which run a point is; merge the runs again as laz"
        raise UsageError(msg)
    ways: list[Trajectory] = []
    segments: list[tuple[float, float]] = []
    origins, end = [], -_PAUSE
    for flight in run.flights:
        way = flight.trajectory
        if not len(way.times):
            msg = f"{folder}: the trajectory of {flight.name} is gone; map or merge again"
            raise InputError(msg)
        late = end + _PAUSE - float(way.times[0]) if ways else 0.0
        ways.append(replace(way, times=way.times + late))
        segments += [(a + late, b + late) for a, b in flight.record.get("segments") or []]
        origins.append((adjusted_gps_origin(flight.start_ns) if is_las else 0.0) - late)
        end = float(ways[-1].times[-1])
    joined = Trajectory(
        np.concatenate([way.times for way in ways]),
        np.concatenate([way.positions for way in ways]),
        np.concatenate([way.quats_xyzw for way in ways]),
    )
    return RunMap(path, joined, segments, run.record.get("georeference"), np.array(origins))


def places_of_run(folder: Path | str, settings: PlaceSettings | None = None) -> list[Place]:
    """Describe the places of a run folder: its map's points, and its trajectory.

    Raises
    ------
    UsageError
        If the folder holds no run, or the run has no map.
    InputError
        If its trajectory or its map cannot be read.
    """
    run = map_of_run(Path(folder))
    poses = run.trajectory
    spans = run.segments or [(float(poses.times[0]), float(poses.times[-1]))]
    stream = PartStream(poses, spans, settings)
    places: list[Place] = []
    for points, times in run.parts():
        if times is None:
            return places_of_cloud(run.path, settings)
        places += describe_parts(stream.add(points, times), settings)
    return [*places, *describe_parts(stream.finish(), settings)]


def places_of_cloud(
    path: Path | str,
    settings: PlaceSettings | None = None,
    *,
    shift: NDArray[np.float64] | None = None,
) -> list[Place]:
    """Describe the places of a gravity-aligned cloud without a run: the whole of it, or tiles.

    The file is read three times or more, and never held as a whole.

    Parameters
    ----------
    shift : (3,) m, taken off the coordinates of a cloud far from its origin

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    settings = settings or PlaceSettings()

    def chunks() -> Iterator[NDArray[np.float64]]:
        for part in read_parts(Path(path)):
            points = part.points[np.isfinite(part.points).all(axis=1)]
            yield points if shift is None else points - shift

    return describe_parts(tiled(chunks, settings), settings)
