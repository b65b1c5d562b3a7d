# SPDX-License-Identifier: MIT OR Apache-2.0
"""Run folders as a run leaves them, made of given points in no time."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.calibration import Calibration
from bentwing.base.geodesy import LevelFrame, ProjectedSystem
from bentwing.base.mount import FixedMount, Pose
from bentwing.base.plain import plain
from bentwing.base.provenance import describe_input
from bentwing.base.run_record import RUN_FOLDER
from bentwing.base.trajectory import Trajectory
from bentwing.closing.georeference.placement import Placement
from bentwing.closing.georeference.projection import MapProjection
from bentwing.map.chunk import MapChunk
from bentwing.map.writer import open_map

if TYPE_CHECKING:
    from pathlib import Path

START_NS = 1_700_000_000_000_000_000
REACH = 300.0


def flight() -> Trajectory:
    """Poses of a flight of 20 s along a circle of 5 m."""
    times = np.arange(0.0, 20.0, 0.01)
    angles = 2 * np.pi * times / 20
    positions = np.stack([5 * np.cos(angles), 5 * np.sin(angles), 1 + 0.1 * times], axis=1)
    zero = np.zeros(len(times))
    quats = np.stack([zero, zero, np.sin(angles / 2), np.cos(angles / 2)], axis=1)
    return Trajectory(times, positions, quats)


def on_earth(epsg: int = 32632) -> MapProjection:
    """Return the place of a map near 48.5° north, turned by 0.7 rad."""
    frame = LevelFrame(9.3, 48.5, 400.0)
    placement = Placement(0.7, np.array([12.0, -3.0, 5.0]), np.full(4, 0.01))
    path = flight().positions
    low, high = path.min(axis=0) - REACH, path.max(axis=0) + REACH
    return MapProjection.over(low, high, frame, placement, ProjectedSystem.of_epsg(epsg))


def finished_run(
    folder: Path,
    points: np.ndarray,
    *,
    placed: MapProjection | None = None,
    map_format: str = "laz",
    shift: np.ndarray | None = None,
    **settings: Any,
) -> Path:
    """Write a run with a map of points (N, 3) m, frame of the trajectory, measured evenly in time."""
    folder.mkdir(parents=True)
    poses, n = flight(), len(points)
    poses.write_tum(folder / "trajectory.txt", START_NS)
    written = points if placed is None else placed.to_projected(points)
    chunk = MapChunk(
        written,
        np.linspace(0.0, 19.9, n),
        np.linspace(1, 20, n).astype(np.float32),
        (np.arange(n) % 200 + 2).astype(np.float32),
        (np.arange(n) % 16).astype(np.uint16),
        incidence=np.linspace(0, 1.5, n).astype(np.float32),
        shift=shift,
    )
    name = f"map.{map_format}"
    wkt = None if placed is None else placed.system.wkt
    with open_map(folder / name, map_format, START_NS, wkt) as writer:
        writer.write(chunk)
    files = ["trajectory.txt", name]
    mount = FixedMount(Pose.identity())
    record = {
        "kind": RUN_FOLDER.kind,
        "complete": True,
        "start_ns": START_NS,
        "recordings": [folder / "gone.bag"],
        "inputs": [],
        "warnings": [],
        "settings": {"map_format": map_format, "map_spacing": 0.0, **settings},
        "segments": [[0.0, float(poses.times[-1])]],
        "calibration": Calibration(0.0, mount, np.zeros(3), np.zeros(3), np.array([0, 0, 9.81])),
        "georeference": None if placed is None else placed.record(),
        "files": files,
        "hashes": {
            file: {k: v for k, v in describe_input(folder / file).items() if k != "name"}
            for file in files
        },
    }
    (folder / "run.json").write_text(json.dumps(plain(record)))
    return folder
