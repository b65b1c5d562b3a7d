# SPDX-License-Identifier: MIT OR Apache-2.0
"""Finished runs whose points are known exactly."""

from __future__ import annotations

import json

import numpy as np

from bentwing.base.trajectory import Trajectory
from bentwing.map.chunk import MapChunk
from bentwing.map.writer import open_map

START_NS = 1_700_000_000 * 10**9


def write_run(folder, points, *, times=None, way=None, map_format="laz", crs_wkt=None, **record):
    """Write points (N, 3) as the map of a finished run, with the way (M, 3) of its sensor."""
    folder.mkdir()
    times = np.linspace(0.0, 10.0, len(points)) if times is None else times
    with open_map(folder / f"map.{map_format}", map_format, START_NS, crs_wkt) as writer:
        if len(points):
            writer.write(MapChunk(points, times, np.ones(len(points), np.float32)))
    if way is not None:
        quats = np.tile([0.0, 0.0, 0.0, 1.0], (len(way), 1))
        stamps = np.linspace(0.0, 10.0, len(way))
        Trajectory(stamps, way, quats).write_tum(folder / "trajectory.txt", START_NS)
    files = [path.name for path in folder.iterdir()]
    described = {"kind": "bentwing run", "complete": True, "files": files, "start_ns": START_NS}
    (folder / "run.json").write_text(json.dumps(described | record))
    return folder


def on_wall(rng, first, last, n, height=3.0, sigma=0.0):
    """Points on an upright wall from the floor at zero, with noise across it."""
    share = rng.uniform(size=(n, 1))
    first, last = np.array(first, float), np.array(last, float)
    along = (last - first) / np.linalg.norm(last - first)
    across = rng.normal(0.0, sigma, (n, 1)) if sigma else np.zeros((n, 1))
    places = first + share * (last - first) + across * [-along[1], along[0]]
    return np.column_stack([places, rng.uniform(0.0, height, n)])


def rooms(sigma=0.01, density=1500):
    """Two rooms of 6 x 4 and 4 x 4 m, divided by a wall of 12 cm, with floor and ceiling at 3 m."""
    rng = np.random.default_rng(100)
    walls = [
        ((0, 0), (10, 0)), ((10, 0), (10, 4)), ((10, 4), (0, 4)), ((0, 4), (0, 0)),
        ((6, 0), (6, 4)), ((6.12, 4), (6.12, 0)),
    ]  # fmt: skip
    lengths = [np.linalg.norm(np.subtract(b, a)) for a, b in walls]
    parts = [
        on_wall(rng, a, b, round(density * 3 * length), sigma=sigma)
        for (a, b), length in zip(walls, lengths, strict=True)
    ]
    for z in (0.0, 3.0):
        n = density * 40 // 4
        parts.append(
            np.column_stack([rng.uniform(0, 10, n), rng.uniform(0, 4, n), rng.normal(z, sigma, n)])
        )
    return rng.permutation(np.concatenate(parts))
