# SPDX-License-Identifier: MIT OR Apache-2.0
"""Reads the map a recording is to be found in: a run folder, or a cloud of any scanner."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import InputError
from bentwing.closing.localize.coordinates import (
    GivenCoordinates,
    coordinates_of_cloud,
    coordinates_of_run,
)
from bentwing.closing.localize.difference import ReferenceCloud
from bentwing.closing.localize.map_surfels import MapSurfels, SurfelMaker, core_surfels
from bentwing.closing.places import map_of_run, places_of_cloud, places_of_run, positions_at
from bentwing.map.read import read_parts

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bentwing import _core
    from bentwing.base.trajectory import Trajectory
    from bentwing.closing.places import Place, RunMap
    from bentwing.odometry.continuous.settings import SurfelSettings

    Seen = tuple[NDArray[np.float64], NDArray[np.float64] | None]

# What is farther from the trajectory than this is out of sight, m.
_REACH = 60.0


@dataclass(frozen=True, slots=True)
class PriorMap:
    """A map that is already right.

    Attributes
    ----------
    path : what was asked for, a run folder or a file
    file : the cloud itself
    places : by which a recording is found in it
    surfels : of each level, with which the recording is registered
    cloud : with which its points are compared
    n_points : of the map
    coordinates : those of the map, where they are not those of the others here
    """

    path: Path
    file: Path
    places: list[Place]
    surfels: list[MapSurfels]
    cloud: ReferenceCloud
    n_points: int
    coordinates: GivenCoordinates | None

    def surfels_near(self, trajectory: Trajectory) -> _core.Surfels:
        """Return the surfels a recording could see, as the registration takes them."""
        return core_surfels([level.near(trajectory.positions, _REACH) for level in self.surfels])


def read_prior_map(path: Path, settings: SurfelSettings) -> PriorMap:
    """Read a run folder, or a gravity-aligned file of one of `MAP_FORMATS`.

    Of a run it is known from where every point was seen, so that the two sides of a wall are told
    apart; of a cloud it is not.

    Raises
    ------
    UsageError
        If the folder holds no run with a map.
    InputError
        If the file cannot be read, or holds no surfaces.
    """
    path = Path(path)
    run = map_of_run(path) if path.is_dir() else None
    given = coordinates_of_cloud(path) if run is None else coordinates_of_run(run.georeference)
    maker, cloud, n_points = SurfelMaker(settings), ReferenceCloud(), 0
    for points, origins in _parts_of_cloud(path, given) if run is None else _parts_of_run(run):
        maker.add(points, origins)
        cloud.add(points, origins)
        n_points += len(points)
    surfels = maker.levels()
    if not any(len(s.means) for s in surfels):
        msg = f"{path}: {n_points} points hold no surfaces of {settings.voxel_size:g} m or more"
        raise InputError(f"{msg}; is it a map, in metres?")
    if run is not None:
        return PriorMap(path, run.path, places_of_run(path), surfels, cloud, n_points, given)
    places = places_of_cloud(path, shift=None if given is None else given.given)
    return PriorMap(path, path, places, surfels, cloud, n_points, given)


def _parts_of_cloud(path: Path, given: GivenCoordinates | None) -> Iterator[Seen]:
    """Points (N, 3) of a cloud; where each was seen from is not known."""
    for part in read_parts(path, None if given is None else given.record):
        yield part.points[np.isfinite(part.points).all(axis=1)], None


def _parts_of_run(run: RunMap) -> Iterator[Seen]:
    """Points (N, 3) of a run's map, and where each was seen from, if the map has times."""
    poses = run.trajectory
    for points, times in run.parts():
        if times is None:
            yield points, None
            continue
        inside = poses.covers(times)
        yield points[inside], positions_at(poses, times[inside])
