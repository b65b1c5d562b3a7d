# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is evaluated: a run folder, or a trajectory or a cloud of any program."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.clock import NS_PER_S
from bentwing.base.errors import UsageError
from bentwing.base.run_record import RECORD, finished_record
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.track import read_track
from bentwing.map.finished_run import map_of
from bentwing.map.formats import MAP_SUFFIXES

if TYPE_CHECKING:
    from bentwing.evaluate.track import Track

_COMMON = 0.5  # of the shorter one, that a reference and the flight it was measured with share


@dataclass(frozen=True, slots=True)
class Subject:
    """Files of one run; None where there is no such file.

    Attributes
    ----------
    trajectory, odometry : TUM, closed-loop and open-loop
    map_path : a cloud
    georeference : where a run has put its map on the Earth
    flights : of a merged map, the trajectory of each run
    """

    trajectory: Path | None
    odometry: Path | None
    map_path: Path | None
    georeference: dict[str, Any] | None = None
    flights: tuple[Path, ...] = ()

    def files(self) -> list[Path]:
        """Return those that exist."""
        listed = (self.trajectory, self.odometry, *self.flights, self.map_path)
        return [path for path in listed if path]

    def flown_with(self, reference: Path) -> Subject:
        """Return the subject with the flight of a merged map that a reference was measured with.

        Raises
        ------
        UsageError
            If it is none or several of them, or there is no trajectory at all.
        InputError
            If a file cannot be read.
        """
        if self.trajectory is not None:
            return self
        if not self.flights:
            msg = "there is no trajectory to compare with --reference-trajectory"
            raise UsageError(msg)
        track = read_track(reference)
        during = [path for path in self.flights if _overlaps(track, path)]
        if len(during) != 1:
            many = "several flights were" if during else "no flight was"
            named = " or ".join(map(str, during or self.flights))
            msg = f"{reference}: {many} under way then; give {named} instead of the folder"
            raise UsageError(msg)
        return replace(self, trajectory=during[0])


def find_subject(path: Path | str) -> Subject:
    """Find trajectory.txt, odometry.txt and map.* in a folder, or take a single file.

    Raises
    ------
    UsageError
        If there is none of them, or the folder holds a run that is not complete.
    InputError
        If a file is not the one that the run wrote.
    """
    path = Path(path)
    if path.is_file():
        is_map = path.suffix.lower() in MAP_SUFFIXES
        return Subject(None if is_map else path, None, path if is_map else None)
    poses = [path / "trajectory.txt", path / "odometry.txt"]
    trajectory, odometry = (file if file.is_file() else None for file in poses)
    record = finished_record(path) if (path / RECORD).exists() else {}
    runs = [path / run["trajectory"] for run in record.get("runs") or []]
    flights = tuple(file for file in runs if file.is_file())
    found = Subject(trajectory, odometry, map_of(path), record.get("georeference"), flights)
    if not found.files():
        what = "has neither trajectory.txt nor map.laz" if path.is_dir() else "does not exist"
        msg = (
            f"{path}: {what}; give the folder of a run, a TUM trajectory, or a cloud "
            f"({', '.join(MAP_SUFFIXES)})"
        )
        raise UsageError(msg)
    return found


def _overlaps(track: Track, path: Path) -> bool:
    """Whether the times of a track and a trajectory have most of either in common."""
    poses, origin_ns = read_tum(path)
    own = poses.times[[0, -1]] + (origin_ns - track.origin_ns) / NS_PER_S
    common = min(own[1], track.times[-1]) - max(own[0], track.times[0])
    return bool(common > _COMMON * min(np.ptp(own), np.ptp(track.times)))
