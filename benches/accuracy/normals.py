# SPDX-License-Identifier: MIT OR Apache-2.0
"""How far the normals of maps are off the true surfaces, on simulated flights.

    python -m benches normals office courtyard --seeds 900 901

Prints a row per flight: the median angle between the normals of points and the triangles they are on, the 95th percentile,
both of points on planes (all surface within 15 cm has one direction) and of all points; and the share
without a normal.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import laspy
import numpy as np

from benches.support import tables
from bentwing import map_recording
from bentwing.evaluate import simulated
from bentwing.evaluate.trajectory import absolute_error
from bentwing.map.read_mesh import read_mesh
from bentwing.simulate import Scenario, simulate
from bentwing.simulate.scenes.world import face_normals

EVERY = 23  # of the points is compared
ON_SURFACE, AROUND, SAME = 0.03, 0.15, np.cos(np.radians(0.5))
COLUMNS = (
    "flight", "points, M", "planes: median, deg", "95 %", "all: median, deg", "95 %", "without",
)  # fmt: skip


def row(scenario: Scenario) -> str:
    """Simulate, map and compare one flight."""
    with tempfile.TemporaryDirectory() as scratch:
        folder, out = Path(scratch) / "recording", Path(scratch) / "run"
        simulate(scenario, folder)
        (recording,) = folder.glob("recording*")
        run = map_recording(recording, folder / "payload.yaml", out, normals=True)
        truth = simulated.Truth(folder)
        placed = absolute_error(run.trajectory, truth.trajectory, during=truth.flight).alignment
        las = laspy.read(out / "map.laz")
        faces, scene = face_normals(read_mesh(folder / "truth_scene.ply")), truth.scene
    points = placed.put(np.ascontiguousarray(las.xyz[::EVERY]))
    normals = np.stack([las[f"normal_{axis}"][::EVERY] for axis in "xyz"], axis=1)
    normals = normals @ placed.R.T
    distances, nearest = scene.distance(points)
    known = np.isfinite(normals[:, 0])
    on = known & (np.abs(distances) < ON_SURFACE)
    true = faces[nearest]
    cosines = np.abs(np.einsum("ni,ni->n", normals, true))
    angles = np.degrees(np.arccos(np.minimum(cosines, 1.0)))
    flat = on & is_flat(scene, faces, points, true)
    figures = [
        f"{np.percentile(angles[rows], share):.2f}" for rows in (flat, on) for share in (50, 95)
    ]
    name = f"{scenario.scene} {scenario.head} {scenario.seed}"
    return tables.line([name, f"{1e-6 * len(las):.2f}", *figures, f"{np.mean(~known):.2%}"])


def is_flat(scene, faces, points, true) -> np.ndarray:
    """Whether all surface around points (N, 3) has the direction of the triangles that they are on."""
    across = np.eye(3)[np.argmin(np.abs(true), axis=1)]
    first = np.cross(true, across)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(true, first)
    flat = np.ones(len(points), bool)
    for turn in np.arange(8) * np.pi / 4:
        beside = points + AROUND * (np.cos(turn) * first + np.sin(turn) * second)
        distances, nearest = scene.distance(np.ascontiguousarray(beside))
        flat &= np.abs(distances) < 2 * ON_SURFACE
        flat &= np.abs(np.einsum("ni,ni->n", faces[nearest], true)) > SAME
    return flat


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--head", default="hokuyo-spin")
    parser.add_argument("--realism", type=float, default=0.0)
    parser.add_argument("--duration", type=float, default=30.0)
    options = parser.parse_args()
    print(tables.head(COLUMNS))
    for scene in options.scenes:
        for seed in options.seeds:
            scenario = Scenario(
                scene=scene, seed=seed, duration=options.duration, head=options.head, realism=options.realism
            )  # fmt: skip
            print(row(scenario), flush=True)
