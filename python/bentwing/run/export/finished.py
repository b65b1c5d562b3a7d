# SPDX-License-Identifier: MIT OR Apache-2.0
"""A finished run, localized run or merged map as an export finds it in its folder."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from bentwing.base.calibration import Calibration
from bentwing.base.clock import NS_PER_S
from bentwing.base.errors import InputError
from bentwing.base.run_record import understood
from bentwing.map.clean import CleanSettings
from bentwing.map.finished_run import FinishedRun, Flight
from bentwing.map.read_chunks import CHUNK_SUFFIXES, MapFile
from bentwing.recording import Payload
from bentwing.run.export.coordinates import Coordinates
from bentwing.run.merging.source import Source, open_source
from bentwing.run.run import Run, estimate_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bentwing.base.covariances import PoseCovariances
    from bentwing.base.mount import Mount

_ROUNDED = 1e-6  # s; stamps in files are rounded to the nanosecond
_REACH = 300.0  # m, of a lidar of which the record says nothing


@dataclass(frozen=True, slots=True)
class Finished:
    """A run that can be exported.

    Attributes
    ----------
    run : as its folder holds it
    flights : of the run, without the breaks of their trajectories
    coordinates : of the map
    """

    run: FinishedRun
    flights: tuple[Flight, ...]
    coordinates: Coordinates

    @classmethod
    def open(cls, run: Run | Path | str) -> Finished:
        """Read a run folder.

        Raises
        ------
        UsageError
            If it holds no run, or one that is not complete, or several separate maps.
        InputError
            If a file of it is not the one that was written, or cannot be read.
        """
        found = FinishedRun.open(run.out if isinstance(run, Run) else run)
        found.require_one_map()
        with understood(found.folder):
            flights = tuple(_unbroken(found, flight) for flight in found.flights)
            reach = _reach_of(found.record)
            path = np.concatenate([flight.trajectory.positions for flight in flights])
            low, high = path.min(axis=0) - reach, path.max(axis=0) + reach
            return cls(found, flights, Coordinates.of_record(found.record, low, high))

    @property
    def mount(self) -> Mount:
        """How the lidar is mounted on the IMU, of a run that is not merged."""
        return Calibration.from_json(self.run.record["calibration"]).mount

    @property
    def covariances(self) -> PoseCovariances | None:
        """Those of the poses; None beside a merged map, and where the estimator has none."""
        if self.run.record.get("runs"):
            return None
        return estimate_of(self.run.folder, self.run.record).covariances

    @property
    def path(self) -> NDArray[np.float64]:
        """Positions (M, 3) m of the IMU in all runs, frame of the trajectory."""
        return np.concatenate([flight.trajectory.positions for flight in self.flights])

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of the poses, s since the start of the (first) recording."""
        ends = [
            flight.trajectory.times[[0, -1]] + (flight.start_ns - self.run.start_ns) / NS_PER_S
            for flight in self.flights
        ]
        return float(np.min(ends)), float(np.max(ends))

    @property
    def spacing(self) -> float:
        """Edge of the voxels, m, of which the map has one point each; 0 for all points."""
        return float(self.run.record["settings"].get("map_spacing") or 0.0)

    @property
    def cleaning(self) -> CleanSettings:
        """What the map leaves out."""
        try:
            return CleanSettings.model_validate(self.run.record["settings"].get("cleaning") or {})
        except ValidationError as error:
            msg = f"{self.run.folder}: run.json says of the map's cleaning what cannot be ({error})"
            raise InputError(msg) from error

    @property
    def refines(self) -> bool:
        """Whether the map's points are moved to the surface that they measured together."""
        return bool(self.run.record["settings"].get("refine"))

    @property
    def has_normals(self) -> bool:
        """Whether the map's points have normals."""
        return bool(self.run.record["settings"].get("normals"))

    @property
    def map_name(self) -> str | None:
        """Name of the map's file; None for a run without one."""
        return next((name for name in self.run.record["files"] if name.startswith("map.")), None)

    def map_file(self) -> MapFile | None:
        """Return the map; None where there is none, or not in a format that keeps everything."""
        name = self.map_name
        if name is None or not name.endswith(CHUNK_SUFFIXES):
            return None
        path = self.run.folder / name
        return MapFile.open(path) if path.is_file() else None

    def sources(self) -> list[Source]:
        """Return the runs with their recordings and the trajectories of the map.

        Raises
        ------
        UsageError, InputError
            If a recording is gone or has changed, or of a merged map one of the runs.
        """
        folder = self.run.folder
        if not self.run.record.get("runs"):
            return [open_source(folder, flight.name) for flight in self.flights]
        return [
            replace(
                open_source(Path(flight.record["folder"]), flight.name),
                estimate=estimate_of(folder, flight.record, flight.record["trajectory"]),
            )
            for flight in self.flights
        ]


def _unbroken(run: FinishedRun, flight: Flight) -> Flight:
    """Return a flight whose trajectory has the poses of its segments only."""
    poses = flight.trajectory
    spans = flight.record.get("segments") or [poses.times[[0, -1]]] if len(poses) else []
    poses = poses.within([(float(a) - _ROUNDED, float(b) + _ROUNDED) for a, b in spans])
    if not len(poses):
        msg = f"{run.folder}: the trajectory of {flight.name} is gone; put it back, or map it again"
        raise InputError(msg)
    return replace(flight, trajectory=poses)


def _reach_of(record: Mapping[str, Any]) -> float:
    described = record["settings"].get("payload")
    return _REACH if described is None else Payload.model_validate(described).lidar.max_range
