# SPDX-License-Identifier: MIT OR Apache-2.0
"""A finished run as its folder holds it, merged and localized ones included: record, flights and map."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import InputError, UsageError
from bentwing.base.gps_time import adjusted_gps_origin
from bentwing.base.run_record import finished_record, understood
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.map.formats import MAP_SUFFIXES
from bentwing.map.read import MapPart, read_parts

if TYPE_CHECKING:
    from collections.abc import Iterator

_LAS = frozenset({".las", ".laz"})
_NOWHERE = Trajectory(np.empty(0), np.empty((0, 3)), np.empty((0, 4)))


@dataclass(frozen=True, slots=True)
class Flight:
    """A recording's way through the map.

    Attributes
    ----------
    name : of its run
    record : what run.json says of it
    trajectory : of the IMU; times in s since the recording's start; empty where its file was taken away
    start_ns : of the recording, ns UTC
    """

    name: str
    record: dict[str, Any]
    trajectory: Trajectory
    start_ns: int


@dataclass(frozen=True, slots=True)
class FinishedRun:
    """A complete run.

    Attributes
    ----------
    folder : of the run
    record : run.json
    flights : one, or those that were merged
    map_path : file of the map; None where there is none
    """

    folder: Path
    record: dict[str, Any]
    flights: tuple[Flight, ...]
    map_path: Path | None

    @classmethod
    def open(cls, folder: Path | str) -> FinishedRun:
        """Read record and trajectories.

        Raises
        ------
        UsageError
            If it is no run folder, or the run is not complete.
        InputError
            If a file is not the one that the run wrote, or a trajectory cannot be read.
        """
        folder = Path(folder)
        record = finished_record(folder)
        with understood(folder):
            return cls(folder, record, tuple(_flights_of(folder, record)), map_of(folder))

    @property
    def start_ns(self) -> int:
        """Time zero of the map, ns UTC."""
        return min(flight.start_ns for flight in self.flights)

    def require_one_map(self) -> None:
        """Refuse the folder of separate maps, which have folders of their own.

        Raises
        ------
        UsageError
        """
        maps = (self.record.get("merging") or {}).get("maps") or []
        if len(maps) > 1 and not self.record.get("runs"):
            named = " or ".join(str(self.folder / one["folder"]) for one in maps)
            msg = f"{self.folder}: holds {len(maps)} separate maps; give {named}"
            raise UsageError(msg)

    def require_map(self) -> Path:
        """Return the file of the map.

        Raises
        ------
        UsageError, InputError
            If there are several, or none.
        """
        self.require_one_map()
        if self.map_path is None:
            msg = f"{self.folder}: the run has no map; run `bentwing map` again, to its end and without --no-map"
            raise InputError(msg)
        return self.map_path

    def parts(self, *, local: bool = False) -> Iterator[MapPart]:
        """Yield the points of the map, with times in s since `start_ns` where it has any.

        Parameters
        ----------
        local : whether points are in the frame of the trajectories, to some millimetres in 300 m

        Raises
        ------
        UsageError, InputError
        """
        path = self.require_map()
        begin = adjusted_gps_origin(self.start_ns) if path.suffix in _LAS else 0.0
        for part in read_parts(path, self.record.get("georeference") if local else None):
            yield MapPart(part.points, None if part.times is None else part.times - begin)


def map_of(folder: Path) -> Path | None:
    """Return the file of the map in a folder."""
    maps = [folder / f"map{suffix}" for suffix in MAP_SUFFIXES]
    return next((path for path in maps if path.is_file()), None)


def _flights_of(folder: Path, record: dict[str, Any]) -> Iterator[Flight]:
    whole = {**record, "name": folder.resolve().name}
    for run in record.get("runs") or [whole]:
        path = folder / run.get("trajectory", "trajectory.txt")
        poses, start_ns = _poses_of(path, run) if path.is_file() else (_NOWHERE, 0)
        yield Flight(run["name"], run, poses, int(run.get("start_ns") or start_ns))


def _poses_of(path: Path, run: dict[str, Any]) -> tuple[Trajectory, int]:
    """Return poses and time zero; records of earlier versions say it by the first segment only."""
    if run.get("start_ns") is not None:
        return read_tum(path, int(run["start_ns"]))
    poses, first_ns = read_tum(path)
    begin = float((run.get("segments") or [[0.0]])[0][0])
    return replace(poses, times=poses.times + begin), first_ns - round(begin * 1e9)
