# SPDX-License-Identifier: MIT OR Apache-2.0
"""A finished run read back from its folder as pictures and reports need it, merged ones included."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.run_record import finished_record, understood
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.map.formats import MAP_SUFFIXES
from bentwing.map.gps_time import adjusted_gps_origin
from bentwing.map.measured import moved_back
from bentwing.map.read import read_parts

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_PAUSE = 10.0  # s between runs that follow each other, as where they were merged
_LAS = frozenset({".las", ".laz"})


@dataclass(frozen=True, slots=True)
class FinishedRun:
    """A complete run; those of a merged map follow each other in time.

    Attributes
    ----------
    folder : of the run
    record : run.json
    trajectory : of the IMU, frame of the map; times in s since the first recording's start
    map : the map's file, None where there is none
    """

    folder: Path
    record: dict[str, Any]
    trajectory: Trajectory
    map: Path | None
    _starts: tuple[int, ...]
    _offsets: tuple[float, ...]

    @classmethod
    def open(cls, folder: Path | str) -> FinishedRun:
        """Read record and trajectories.

        Raises
        ------
        UsageError
            If it is no run folder, or the run is not complete.
        InputError
            If its trajectory cannot be read.
        """
        record = finished_record(Path(folder))
        with understood(Path(folder)):
            return cls._of(Path(folder), record)

    @classmethod
    def _of(cls, folder: Path, record: dict[str, Any]) -> FinishedRun:
        poses: list[Trajectory] = []
        starts: list[int] = []
        offsets: list[float] = []
        for run in record.get("runs") or [record]:
            path = folder / run.get("trajectory", "trajectory.txt")
            if not path.exists() and not poses and record.get("merging"):
                break  # of separate maps, which have folders of their own
            one, start_ns = trajectory_of(path, run)
            offset = poses[-1].times[-1] + _PAUSE - one.times[0] if poses else 0.0
            poses.append(Trajectory(one.times + offset, one.positions, one.quats_xyzw))
            starts.append(start_ns)
            offsets.append(float(offset))
        return cls(folder, record, _joined(poses), map_of(folder), tuple(starts), tuple(offsets))

    def parts(self) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Yield the points (N, 3) m of the map in the trajectory's frame as measured, with times (N,) s.

        Raises
        ------
        InputError
        """
        if self.map is None:
            return
        begin = adjusted_gps_origin(min(self._starts)) if self.map.suffix in _LAS else 0.0
        late = np.array(self._offsets) - [(s - min(self._starts)) / 1e9 for s in self._starts]
        runs, shifts = self._column("run_id"), self._column("shift")
        for part in read_parts(self.map, self.record.get("georeference")):
            times = np.zeros(len(part.points)) if part.times is None else part.times - begin
            run = np.clip(next(runs).astype(np.intp), 0, len(self._starts) - 1)
            times = times + late[run]
            yield self._measured(part.points, times, next(shifts)), times

    def _measured(self, points: Array, times: Array, shifts: NDArray[Any]) -> Array:
        """Return points before they were moved along their beams; the lidar is nearly where the IMU is."""
        if not shifts.any() or not len(self.trajectory.times):
            return points
        begin, end = self.trajectory.times[[0, -1]]
        seen_from = self.trajectory.interpolate(np.clip(times, begin, end))[0]
        return moved_back(points, seen_from, shifts.astype(np.float64))

    def _column(self, name: str) -> Iterator[NDArray[Any]]:
        """Yield a column of the map part by part, and zero where it does not have it."""
        if self.map is not None and self.map.suffix in _LAS:
            from bentwing.map.read_las import las_column

            yield from las_column(self.map, name)
        while True:
            yield np.zeros(1)


def trajectory_of(path: Path, record: Mapping[str, Any]) -> tuple[Trajectory, int]:
    """Return the trajectory and the recording's start, ns."""
    absolute, first_ns = read_tum(path)
    begin = float((record.get("segments") or [[0.0]])[0][0])
    times = absolute.times + begin
    return (
        Trajectory(times, absolute.positions, absolute.quats_xyzw),
        first_ns - round(begin * 1e9),
    )


def map_of(folder: Path) -> Path | None:
    """Return the map of a run folder."""
    maps = [folder / f"map{suffix}" for suffix in MAP_SUFFIXES]
    return next((path for path in maps if path.exists()), None)


def _joined(poses: list[Trajectory]) -> Trajectory:
    if not poses:
        return Trajectory(np.empty(0), np.empty((0, 3)), np.empty((0, 4)))
    return Trajectory(
        np.concatenate([one.times for one in poses]),
        np.concatenate([one.positions for one in poses]),
        np.concatenate([one.quats_xyzw for one in poses]),
    )
