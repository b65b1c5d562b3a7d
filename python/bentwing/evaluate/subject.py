# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is evaluated: a run folder, or a trajectory or a cloud of any program."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bentwing.base.errors import UsageError
from bentwing.base.run_record import RECORD, finished_record
from bentwing.map.finished_run import map_of
from bentwing.map.formats import MAP_SUFFIXES


@dataclass(frozen=True, slots=True)
class Subject:
    """Files of one run; None where there is no such file.

    Attributes
    ----------
    trajectory, odometry : TUM, closed-loop and open-loop
    map_path : a cloud
    georeference : where a run has put its map on the Earth
    """

    trajectory: Path | None
    odometry: Path | None
    map_path: Path | None
    georeference: dict[str, Any] | None = None

    def files(self) -> list[Path]:
        """Return those that exist."""
        return [path for path in (self.trajectory, self.odometry, self.map_path) if path]


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
    found = Subject(trajectory, odometry, map_of(path), _georeference(path))
    if not found.files():
        what = "has neither trajectory.txt nor map.laz" if path.is_dir() else "does not exist"
        msg = (
            f"{path}: {what}; give the folder of a run, a TUM trajectory, or a cloud "
            f"({', '.join(MAP_SUFFIXES)})"
        )
        raise UsageError(msg)
    return found


def _georeference(folder: Path) -> dict[str, Any] | None:
    """Return what the record of a run says; a folder of another program has none."""
    return finished_record(folder).get("georeference") if (folder / RECORD).exists() else None
