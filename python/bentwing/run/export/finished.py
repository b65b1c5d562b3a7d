# SPDX-License-Identifier: MIT OR Apache-2.0
"""A finished run, localized run or merged map as an export finds it in its folder."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from bentwing.base.calibration import Calibration
from bentwing.base.errors import InputError, UsageError
from bentwing.base.run_record import finished_record, understood
from bentwing.map.clean import CleanSettings
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
    from bentwing.base.trajectory import Trajectory

_REACH = 300.0  # m, of a lidar of which the record says nothing


@dataclass(frozen=True, slots=True)
class Finished:
    """A run that can be exported.

    Attributes
    ----------
    folder : of the run
    record : its run.json
    trajectories : by the names of the runs, in the frame of the trajectory; one without merging
    start_ns : by the names of the runs, time zero of their recordings, ns UTC
    coordinates : of the map
    covariances : of the trajectories, None where the estimator has none
    """

    folder: Path
    record: Mapping[str, Any]
    trajectories: dict[str, Trajectory]
    start_ns: dict[str, int]
    coordinates: Coordinates
    covariances: dict[str, PoseCovariances | None]

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
        folder = run.out if isinstance(run, Run) else Path(run)
        record = finished_record(folder)
        with understood(folder):
            _require_one_map(folder, record)
            parts = record.get("runs") or [
                {**record, "name": folder.resolve().name, "trajectory": "trajectory.txt"}
            ]
            _require_clock(folder, parts)
            poses, covariances = {}, {}
            for part in parts:
                estimate = estimate_of(folder, part, part["trajectory"])
                poses[part["name"]] = estimate.trajectory.within(estimate.segments)
                # Beside a merged map there are none of its runs.
                covariances[part["name"]] = estimate.covariances if len(parts) == 1 else None
            starts = {part["name"]: int(part["start_ns"]) for part in parts}
            reach = _reach_of(record)
            path = np.concatenate([trajectory.positions for trajectory in poses.values()])
            low, high = path.min(axis=0) - reach, path.max(axis=0) + reach
            coordinates = Coordinates.of_record(record, low, high)
            return cls(folder, record, poses, starts, coordinates, covariances)

    @property
    def mount(self) -> Mount:
        """How the lidar is mounted on the IMU, of a run that is not merged."""
        return Calibration.from_json(self.record["calibration"]).mount

    @property
    def origin_ns(self) -> int:
        """Time zero of the map, ns UTC."""
        return min(self.start_ns.values())

    @property
    def path(self) -> NDArray[np.float64]:
        """Positions (M, 3) m of the IMU in all runs, frame of the trajectory."""
        return np.concatenate([poses.positions for poses in self.trajectories.values()])

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of the poses, s since the start of the (first) recording."""
        late = {name: (ns - self.origin_ns) / 1e9 for name, ns in self.start_ns.items()}
        firsts = [poses.times[0] + late[name] for name, poses in self.trajectories.items()]
        lasts = [poses.times[-1] + late[name] for name, poses in self.trajectories.items()]
        return float(min(firsts)), float(max(lasts))

    @property
    def spacing(self) -> float:
        """Edge of the voxels, m, of which the map has one point each; 0 for all points."""
        return float(self.record["settings"].get("map_spacing") or 0.0)

    @property
    def cleaning(self) -> CleanSettings:
        """What the map leaves out."""
        try:
            return CleanSettings.model_validate(self.record["settings"].get("cleaning") or {})
        except ValidationError as error:
            msg = f"{self.folder}: run.json says of the map's cleaning what cannot be ({error})"
            raise InputError(msg) from error

    @property
    def refines(self) -> bool:
        """Whether the map's points are moved to the surface that they measured together."""
        return bool(self.record["settings"].get("refine"))

    @property
    def map_name(self) -> str | None:
        """Name of the map's file; None for a run without one."""
        return next((name for name in self.record["files"] if name.startswith("map.")), None)

    def map_file(self) -> MapFile | None:
        """Return the map; None where there is none, or not in a format that keeps everything."""
        name = self.map_name
        if name is None or not name.endswith(CHUNK_SUFFIXES):
            return None
        path = self.folder / name
        return MapFile.open(path) if path.is_file() else None

    def sources(self) -> list[Source]:
        """Return the runs with their recordings and the trajectories of the map.

        Raises
        ------
        UsageError, InputError
            If a recording is gone or has changed, or of a merged map one of the runs.
        """
        runs = self.record.get("runs")
        if not runs:
            return [open_source(self.folder, self.folder.resolve().name)]
        return [
            replace(
                open_source(Path(run["folder"]), run["name"]),
                estimate=estimate_of(self.folder, run, run["trajectory"]),
            )
            for run in runs
        ]


def _require_one_map(folder: Path, record: Mapping[str, Any]) -> None:
    maps = (record.get("merging") or {}).get("maps") or []
    if len(maps) > 1 and not record.get("runs"):
        named = " or ".join(str(folder / one["folder"]) for one in maps)
        msg = f"{folder}: holds {len(maps)} separate maps; export {named}"
        raise UsageError(msg)


def _require_clock(folder: Path, parts: list[dict[str, Any]]) -> None:
    if any(part.get("start_ns") is None for part in parts):
        msg = f"{folder}: run.json does not name time zero, as those of earlier versions; map it again"
        raise UsageError(msg)


def _reach_of(record: Mapping[str, Any]) -> float:
    described = record["settings"].get("payload")
    return _REACH if described is None else Payload.model_validate(described).lidar.max_range
