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
from bentwing.map.sample import VALUES

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
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

    def parts(self) -> Iterator[tuple[Array, Array]]:
        """Yield the points (N, 3) m of the map in the trajectory's frame, with times (N,) s.

        Raises
        ------
        UsageError, InputError
        """
        for points, times, _ in self._rows({}, 1):
            yield points, times

    def sample(self, step: int) -> Iterator[tuple[Array, Array, NDArray[np.float32]]]:
        """Yield every `step`-th point as it was measured, before the map was refined.

        Yields
        ------
        Points (N, 3) m in the trajectory's frame, times (N,) s, and their `VALUES` (N, 3), NaN where the
        file of the map does not have them.

        Raises
        ------
        UsageError, InputError
        """
        missing = {"shift": 0.0, **dict.fromkeys(VALUES, np.nan)}
        for points, times, (shifts, *known) in self._rows(missing, step):
            values = np.stack(known, axis=1).astype(np.float32)
            values[:, VALUES.index("incidence")] *= np.radians(1.0)  # files have degrees
            yield self._measured(points, times, shifts), times, values

    def _rows(
        self, missing: Mapping[str, float], step: int
    ) -> Iterator[tuple[Array, Array, list[NDArray[Any]]]]:
        """Yield every `step`-th point with its time and columns, which may be missing."""
        first = self.run.start_ns
        starts = [(flight.start_ns - first) / 1e9 for flight in self.run.flights]
        late = np.array(self._offsets) - starts
        columns, passed = self._columns({"run_id": 0, **missing}), 0
        for part in self.run.parts(local=True):
            n = len(part.points)
            chosen = slice(-passed % step, None, step)
            passed += n
            numbers, *rest = (np.broadcast_to(column, n)[chosen] for column in next(columns))
            times = np.zeros(n) if part.times is None else part.times
            own = late[np.clip(numbers.astype(np.intp), 0, len(late) - 1)]
            yield part.points[chosen], times[chosen] + own, rest

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

    def _columns(self, missing: Mapping[str, float]) -> Iterator[list[NDArray[Any]]]:
        """Yield columns of the map part by part; of a file without columns a single row, again and again."""
        path = self.run.map_path
        if path is not None and path.suffix in {".las", ".laz"}:
            from bentwing.map.read_las import las_columns

            yield from las_columns(path, missing)
            return
        while True:
            yield [np.full(1, value) for value in missing.values()]


def _joined(poses: list[Trajectory]) -> Trajectory:
    return Trajectory(
        np.concatenate([one.times for one in poses]),
        np.concatenate([one.positions for one in poses]),
        np.concatenate([one.quats_xyzw for one in poses]),
    )
