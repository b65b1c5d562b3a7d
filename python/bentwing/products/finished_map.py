# SPDX-License-Identifier: MIT OR Apache-2.0
"""The map of a finished run, or of runs that were merged, with the ways of its sensors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import InputError, UsageError
from bentwing.base.regular_file import resolved
from bentwing.base.run_record import RECORD, finished_record, understood
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.map.epsg import epsg_of_map
from bentwing.map.formats import MAP_SUFFIXES
from bentwing.map.gps_time import adjusted_gps_origin
from bentwing.map.read import MapPart, read_parts

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

_ROUND = 100.0  # m, of the place that coordinates are relative to
_STAMPS = 1e-6  # s; those of files are rounded


@dataclass(frozen=True, slots=True)
class FinishedMap:
    """A map that is read part by part, as often as needed.

    Coordinates are relative to a round place nearby, because projected ones are too large for voxels.

    Attributes
    ----------
    folder : of the run
    path : file of the map
    record : run.json
    origin : (3,) m, of the coordinates used here in those of the file; its height is zero
    epsg : of the file's coordinates; None where they are the run's own
    start_ns : time zero, ns UTC
    ways : of the sensors, one for each run, in the coordinates used here; empty where there is none
    """

    folder: Path
    path: Path
    record: Mapping[str, Any]
    origin: NDArray[np.float64]
    epsg: int | None
    start_ns: int
    ways: tuple[Trajectory, ...]

    def parts(self) -> Iterator[MapPart]:
        """Read points, and times in s since the recording's start where the file has any."""
        begin = adjusted_gps_origin(self.start_ns) if self.path.suffix in {".laz", ".las"} else 0.0
        for part in read_parts(self.path):
            times = None if part.times is None else part.times - begin
            yield MapPart(part.points - self.origin, times)

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

    def require_output(self, out: Path, suffixes: tuple[str, ...]) -> None:
        """Refuse a file that cannot be written, is a result of the run, or of another kind.

        Raises
        ------
        UsageError
        """
        if out.suffix.lower() not in suffixes:
            msg = f"{out}: its name must end with {' or '.join(suffixes)}"
            raise UsageError(msg)
        if not out.parent.is_dir():
            msg = f"{out}: there is no folder {out.parent}; make it, or name a file elsewhere"
            raise UsageError(msg)
        results = {resolved(self.folder / name) for name in (*self.record["files"], RECORD)}
        if resolved(out) in results:
            msg = f"{out}: is a result of the run; name another file"
            raise UsageError(msg)


def open_map_of(run: Path | str) -> FinishedMap:
    """Open the map of a run folder.

    Raises
    ------
    UsageError
        If the folder holds no run, or one that is not complete.
    InputError
        If it has no map, an empty one, or a file is not the one that the run wrote.
    """
    folder = Path(run)
    record = finished_record(folder)
    path = next((p for s in MAP_SUFFIXES if (p := folder / f"map{s}").is_file()), None)
    if path is None:
        msg = f"{folder}: the run has no map; run `bentwing map` again, to its end and without --no-map"
        raise InputError(msg)
    first = next((part.points for part in read_parts(path) if len(part.points)), None)
    if first is None:
        msg = f"{path}: holds no point; give a run with a map"
        raise InputError(msg)
    origin = np.round(np.median(first, axis=0) / _ROUND) * _ROUND * [1.0, 1.0, 0.0]
    with understood(folder):
        start_ns = _start_of(record)
        ways = _ways_of(folder, record, start_ns, origin)
    return FinishedMap(folder, path, record, origin, epsg_of_map(path), start_ns, ways)


def _start_of(record: Mapping[str, Any]) -> int:
    starts = [int(run["start_ns"]) for run in record.get("runs") or [record]]
    return min(starts)


def _ways_of(
    folder: Path, record: Mapping[str, Any], start_ns: int, origin: NDArray[np.float64]
) -> tuple[Trajectory, ...]:
    """Return the trajectories in the coordinates of the map, less the origin."""
    names = [run["trajectory"] for run in record.get("runs") or [{"trajectory": "trajectory.txt"}]]
    found = [read_tum(path, start_ns)[0] for name in names if (path := folder / name).is_file()]
    linear = (record.get("georeference") or {}).get("linear")
    moved = []
    for way in found:
        positions = way.positions
        if linear:
            local = positions - np.array(linear["map"])
            positions = local @ np.array(linear["matrix"]).T + np.array(linear["projected"])
        moved.append(replace(way, positions=positions - origin))
    return tuple(moved)
