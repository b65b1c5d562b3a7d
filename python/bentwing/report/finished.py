# SPDX-License-Identifier: MIT OR Apache-2.0
"""A finished run as pictures and reports show it: one trajectory, and the points as measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.trajectory import Trajectory
from bentwing.map.change import Change
from bentwing.map.finished_run import FinishedRun
from bentwing.map.measured import moved_back
from bentwing.map.read import read_parts

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_CHANGES = ("appeared", "disappeared")
_PAUSE = 10.0  # s between runs that follow each other, as where they were merged


@dataclass(frozen=True, slots=True)
class ShownRun:
    """A complete run; those of a merged map follow each other in time.

    Attributes
    ----------
    run : as its folder holds it
    trajectory : of the IMU, frame of the map; times in s since the first recording's start
    """

    run: FinishedRun
    trajectory: Trajectory
    _offsets: tuple[float, ...]

    @classmethod
    def open(cls, folder: Path | str) -> ShownRun:
        """Read a run folder; raises as `FinishedRun.open`."""
        run, end = FinishedRun.open(folder), None
        poses, offsets = [], []
        for flight in run.flights:
            one = flight.trajectory
            offset = 0.0 if end is None else end + _PAUSE - one.times[0]
            poses.append(Trajectory(one.times + offset, one.positions, one.quats_xyzw))
            offsets.append(float(offset))
            end = poses[-1].times[-1] if len(one) else end
        return cls(run, _joined(poses), tuple(offsets))

    def parts(self, *, measured: bool = False) -> Iterator[tuple[Array, Array]]:
        """Yield the points (N, 3) m of the map in the trajectory's frame, with times (N,) s.

        Parameters
        ----------
        measured : whether points are where they were before the map was refined

        Raises
        ------
        UsageError, InputError
        """
        first = self.run.start_ns
        starts = [(flight.start_ns - first) / 1e9 for flight in self.run.flights]
        late = np.array(self._offsets) - starts
        numbers, shifts = self._column("run_id"), self._column("shift")
        for part in self.run.parts(local=True):
            times = np.zeros(len(part.points)) if part.times is None else part.times
            number = np.clip(next(numbers).astype(np.intp), 0, len(late) - 1)
            times = times + late[number]
            shift = next(shifts)
            yield self._measured(part.points, times, shift) if measured else part.points, times

    def change(self) -> Change | None:
        """Return what has changed since the map in which the run was localized; None of other runs.

        Raises
        ------
        InputError
        """
        files = [self.run.folder / name for name in self.run.record["files"]]
        found = {path.stem: path for path in files if path.stem in _CHANGES and path.is_file()}
        if len(found) < len(_CHANGES):
            return None
        placed = self.run.record.get("georeference")
        clouds = [[p.points for p in read_parts(found[name], placed)] for name in _CHANGES]
        return Change(*(np.concatenate([np.empty((0, 3)), *parts]) for parts in clouds))

    def _measured(self, points: Array, times: Array, shifts: NDArray[Any]) -> Array:
        """Return points before they were moved along their beams; the lidar is nearly where the IMU is."""
        if not shifts.any() or not len(self.trajectory.times):
            return points
        begin, end = self.trajectory.times[[0, -1]]
        seen_from = self.trajectory.interpolate(np.clip(times, begin, end))[0]
        return moved_back(points, seen_from, shifts.astype(np.float64))

    def _column(self, name: str) -> Iterator[NDArray[Any]]:
        """Yield a column of the map part by part, and zero where it does not have it."""
        path = self.run.map_path
        if path is not None and path.suffix in {".las", ".laz"}:
            from bentwing.map.read_las import las_column

            yield from las_column(path, name)
        while True:
            yield np.zeros(1)


def _joined(poses: list[Trajectory]) -> Trajectory:
    return Trajectory(
        np.concatenate([one.times for one in poses]),
        np.concatenate([one.positions for one in poses]),
        np.concatenate([one.quats_xyzw for one in poses]),
    )
