# SPDX-License-Identifier: MIT OR Apache-2.0
"""How much nearer to the true surfaces refined points are, on simulated flights and on exact shapes.

    python -m benches refine courtyard office forest --seeds 900 901
    python -m benches refine --shapes

The first prints a row per flight: robust standard deviation, mean and share beyond 3 cm of the signed distance from the
true surfaces, of the points as measured and as refined; the share that was moved; the true surface
that has a point within 10 cm, over that of the points as measured; the true deviation over the stated one; and the seconds of
all processors together per million points.
The second measures shapes in memory: what is left of steps, the width of edges and creases, the radius of cylinders and the
distance between the sides of a plate.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from benches.support import refined_shapes, tables
from bentwing import map_recording
from bentwing.base.progress import Progress
from bentwing.evaluate import simulated
from bentwing.evaluate.robust import MAD_TO_STD
from bentwing.evaluate.surface import Surface
from bentwing.evaluate.surfels import surfels_of_mesh
from bentwing.evaluate.trajectory import absolute_error
from bentwing.map.clean import clean
from bentwing.map.project import project
from bentwing.map.read_mesh import read_mesh
from bentwing.map.refine import refine
from bentwing.recording import Payload, Recording
from bentwing.recording.preprocess import RecordingPart
from bentwing.simulate import Scenario, simulate

SCENES = ["courtyard", "office", "cave", "mine", "forest"]
EVERY = 11  # of the points is compared
ON_SURFACE, FAR, CELL = 0.2, 0.03, 0.1  # m
COLUMNS = (
    "flight", "points, M", "raw, mm", "refined, mm", "ratio", "shift of mean, mm", "beyond 3 cm",
    "moved", "complete", "true over stated", "CPU s per M",
)  # fmt: skip


def flight(folder: Path, out: Path):
    """Map a flight; yields its cleaned points as one list of chunks, and its trajectory."""
    payload = Payload.load(folder / "payload.yaml")
    (recording,) = folder.glob("recording*")
    run = map_recording(recording, folder / "payload.yaml", out, refine=False)
    with Recording(recording, payload) as opened:
        part = RecordingPart(opened, payload)
        with Progress().stage("points", part.length) as unseen:
            batches = part.batches(unseen, Counter())
            points = project(batches, run.trajectory, run.estimate.calibration)
            return list(clean(points, out, duration=part.length)), run.trajectory


def robust(values) -> float:
    return MAD_TO_STD * float(np.median(np.abs(values - np.median(values))))


def row(scenario: Scenario) -> str:
    """Simulate, map, refine and compare one flight."""
    with tempfile.TemporaryDirectory() as scratch:
        folder, out = Path(scratch) / "recording", Path(scratch) / "run"
        simulate(scenario, folder)
        chunks, trajectory = flight(folder, out)
        record: dict = {}
        start = time.process_time()
        refined = list(refine(iter(chunks), out, record=record))
        seconds = time.process_time() - start
        truth = simulated.Truth(folder)
        placed = absolute_error(trajectory, truth.trajectory, during=truth.flight).alignment
        cells = compare(chunks, refined, placed, truth)
    n = sum(len(chunk) for chunk in chunks)
    name = f"{scenario.scene} {scenario.head} {scenario.seed}"
    left = [f"{record['moved']:.1%}", *cells[-2:], f"{1e6 * seconds / n:.2f}"]
    return tables.line([name, f"{1e-6 * n:.2f}", *cells[:-2], *left])


def compare(chunks, refined, placed, truth) -> list[str]:
    """Distances of the points from the true surfaces, before and after."""
    raw, new = (np.concatenate([chunk.points for chunk in part]) for part in (chunks, refined))
    sigmas = np.concatenate([chunk.sigma for chunk in refined])[::EVERY]
    incidence = np.concatenate([chunk.incidence for chunk in refined])[::EVERY]
    before, after = (truth.distances(placed.put(points[::EVERY])) for points in (raw, new))
    on = np.abs(before) < ON_SURFACE
    before, after, sigmas, incidence = before[on], after[on], sigmas[on], incidence[on]
    near = np.abs(before) < FAR
    stated = after / (sigmas * np.cos(incidence))
    mesh = read_mesh(truth.folder / "truth_scene.ply")
    surface = Surface(surfels_of_mesh(mesh, np.zeros(3), CELL))
    seen = [len(surface.within(placed.put(points), CELL)) for points in (raw, new)]
    return [
        f"{1e3 * robust(before):.2f}", f"{1e3 * robust(after):.2f}", f"{robust(after) / robust(before):.2f}",
        f"{1e3 * (after[near].mean() - before[near].mean()):+.2f}",
        f"{np.mean(np.abs(before) > FAR):.2%} → {np.mean(np.abs(after) > FAR):.2%}",
        f"{seen[1] / seen[0]:.3f}", f"{robust(stated[np.isfinite(stated)]):.2f}",
    ]  # fmt: skip


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--head", default="hokuyo-spin")
    parser.add_argument("--realism", type=float, default=0.0)
    parser.add_argument("--duration", type=float, default=40.0)
    parser.add_argument("--shapes", action="store_true")
    options = parser.parse_args()
    if options.shapes:
        refined_shapes.show()
        return
    print(tables.head(COLUMNS))
    for scene in options.scenes or SCENES:
        for seed in options.seeds:
            scenario = Scenario(
                scene=scene, seed=seed, duration=options.duration, head=options.head, realism=options.realism
            )  # fmt: skip
            print(row(scenario), flush=True)
