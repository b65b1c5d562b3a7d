# SPDX-License-Identifier: MIT OR Apache-2.0
"""Places of what lies on the disk: run folders, and clouds of other scanners."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.base.gps_time import adjusted_gps_origin
from bentwing.base.run_record import finished_record
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.closing.places.cut import describe_parts
from bentwing.closing.places.settings import PlaceSettings
from bentwing.closing.places.stream import PartStream
from bentwing.closing.places.tiles import tiled
from bentwing.map.finished_run import map_of
from bentwing.map.read import read_parts

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    from bentwing.closing.places.place import Place


@dataclass(frozen=True, slots=True)
class RunMap:
    """The map of a run folder, and the way it was seen from.

    Attributes
    ----------
    path : of the map's file
    trajectory : on the clock of the run
    segments : first and last time of each stretch of it without a break, s
    georeference : of the map's coordinates, as run.json has it
    """

    path: Path
    trajectory: Trajectory
    segments: list[tuple[float, float]]
    georeference: Mapping[str, Any] | None
    _origin: float

    def parts(self) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64] | None]]:
        """Points (N, 3) m, map frame, and their times (N,) on the clock of the trajectory if the map has any.

        Raises
        ------
        InputError
            If the map cannot be read.
        """
        for part in read_parts(self.path, self.georeference):
            yield part.points, None if part.times is None else part.times - self._origin


def map_of_run(folder: Path) -> RunMap:
    """Find the map of a run folder.

    Raises
    ------
    UsageError
        If the folder holds no run, or the run has no map.
    InputError
        If its trajectory cannot be read.
    """
    folder = Path(folder)
    record = finished_record(folder)
    segments = [(float(a), float(b)) for a, b in record.get("segments") or []]
    begin = segments[0][0] if segments else 0.0
    path = map_of(folder)
    if path is None:
        msg = f"{folder}: the run has no map; run `bentwing map` again, to its end and without --no-map"
        raise UsageError(msg)
    absolute, first_ns = read_tum(folder / "trajectory.txt")
    trajectory = Trajectory(absolute.times + begin, absolute.positions, absolute.quats_xyzw)
    is_las = path.suffix in {".laz", ".las"}
    origin = adjusted_gps_origin(first_ns - round(begin * 1e9)) if is_las else 0.0
    return RunMap(path, trajectory, segments, record.get("georeference"), origin)


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
