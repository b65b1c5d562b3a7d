# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is left out of a map, and where on the Earth it is, against the truth of simulated flights.

    python -m benches map_quality courtyard office --seeds 851 852

simulates flights in which somebody walks about, with an RTK receiver, maps them (open loop), and prints
one row per flight: shares that are left out of the points of the person, of others that are 25 cm off
all surfaces (mixed pixels), and of those on still surfaces; offset of the georeferenced map from the true coordinates, and the residuals of surveyed points.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from pathlib import Path

import laspy
import numpy as np
import yaml

from benches.support import tables
from bentwing import map_recording
from bentwing.base.geodesy import LevelFrame, ProjectedSystem
from bentwing.base.gps_time import adjusted_gps_origin
from bentwing.base.progress import Progress
from bentwing.base.run_record import read_record
from bentwing.base.trajectory import read_tum
from bentwing.closing.georeference.settings import GeoreferenceSettings
from bentwing.evaluate import simulated
from bentwing.evaluate.alignment import align
from bentwing.map.project import project
from bentwing.map.read_mesh import read_mesh
from bentwing.recording import Payload, Recording
from bentwing.recording.preprocess import RecordingPart
from bentwing.simulate import Scenario, simulate
from bentwing.simulate.events import Person
from bentwing.simulate.ros import EPOCH_NS
from bentwing.simulate.simulation import prepare

STILL, OFF = 0.03, 0.25  # m from the true surfaces: on them, and far from them
GIRTH, SIZE = 0.5, 2.0  # m, around somebody who walks
EVERY = 7  # of the points is compared
N_MARKS = 16
COLUMNS = (
    "flight", "person left out", "off surfaces", "still left out", "map off, mm", "heading off, mrad",
    "control rms, mm", "check rms, mm", "check max, mm", "map stage, s",
)  # fmt: skip


class Truth:
    """The simulated world and where it is."""

    def __init__(self, folder: Path) -> None:
        self.simulated = simulated.Truth(folder)
        mesh = read_mesh(folder / "truth_scene.ply")
        corners = mesh.vertices[mesh.triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self.normals = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
        where = yaml.safe_load((folder / "truth_georeference.yaml").read_text())
        self.frame = LevelFrame(where["longitude"], where["latitude"], where["height"])
        c, s = np.cos(where["heading"]), np.sin(where["heading"])
        self.turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        self.system = ProjectedSystem.utm(where["longitude"], where["latitude"])

    def to_world(self, projected):
        return self.frame.from_geodetic(self.system.to_geodetic(projected)) @ self.turn

    def to_projected(self, world):
        return self.system.from_geodetic(self.frame.to_geodetic(world @ self.turn.T))

    def distances(self, world):
        return self.simulated.scene.distance(np.ascontiguousarray(world))


def aligned(points, trajectory, truth):
    """Bring points of a map to the world by the trajectories."""
    inside = truth.covers(trajectory.times)
    theirs, _ = truth.interpolate(trajectory.times[inside])
    found = align(trajectory.positions[inside], theirs)
    return points @ found.R.T + found.t


def left_out(folder: Path, scenario: Scenario, run, truth: Truth) -> tuple[float, float, float]:
    """Shares that the map does not have: of the person, of what else is off, of the still world."""
    payload = Payload.load(folder / "payload.yaml")
    with Recording(folder / "recording.bag", payload) as recording:
        part = RecordingPart(recording, payload)
        with Progress().stage("all points", part.length) as unseen:
            batches = part.batches(unseen, Counter())
            chunks = list(project(batches, run.trajectory, run.estimate.calibration))
        true, _ = read_tum(folder / "truth_trajectory.txt", recording.clock.start_ns)
        origin_ns = recording.clock.start_ns
    times = np.concatenate([c.times for c in chunks])
    kept = laspy.read(run.out / "map.laz").gps_time
    kept = np.sort(np.asarray(kept) - adjusted_gps_origin(origin_ns))
    at = np.clip(np.searchsorted(kept, times), 1, len(kept) - 1)
    nearest = np.minimum(np.abs(kept[at] - times), np.abs(kept[at - 1] - times))
    stays = (nearest < 1e-6)[::EVERY]  # LAS has steps of 60 ns, beams of 17 µs
    points = np.concatenate([c.points for c in chunks])[::EVERY]
    world = aligned(points, run.trajectory, true)
    off = np.abs(truth.distances(world)[0])
    moments = times[::EVERY] + 1e-9 * (origin_ns - EPOCH_NS)
    person = next(m for m in prepare(scenario).sensors.ranger.movers if isinstance(m, Person))
    gaps = world - person.positions(moments)
    near = (np.hypot(*gaps.T[:2]) < GIRTH) & (gaps[:, 2] < SIZE)
    shares = [near & (off > 0.1), ~near & (off > OFF), off < STILL]
    return tuple(float(np.mean(~stays[share])) for share in shares)


def survey(path: Path, projected, truth: Truth) -> None:
    """Write marks on true floors and walls where the map has points."""
    rng = np.random.default_rng(0)
    world = truth.to_world(projected)
    off, faces = truth.distances(world)
    normals = truth.normals[faces]
    rows: list[str] = []
    for is_floor in (True, False) * (N_MARKS // 2):
        for i in rng.permutation(len(world)):
            upright = abs(normals[i, 2])
            if abs(off[i]) > STILL or (upright < 0.99 if is_floor else upright > 0.05):
                continue
            gaps = world - world[i]
            near = np.linalg.norm(gaps, axis=1) < 0.3
            if near.sum() > 25 and np.ptp(gaps[near] @ normals[i]) < 0.12:
                break
        x, y, z = truth.to_projected((world[i] - off[i] * normals[i])[None])[0]
        use = "check" if len(rows) % 4 > 1 else "control"
        rows.append(f"M{len(rows)},{x:.4f},{y:.4f},{z:.4f},0.25,{use}")
    path.write_text("id,x,y,z,radius,use\n" + "\n".join(rows) + "\n", encoding="utf-8")


def offset(projected, truth: Truth) -> tuple[float, float]:
    """Length of the shift, m, and heading, rad, that would bring a map to the true surfaces."""
    world = truth.to_world(projected)
    off, faces = truth.distances(world)
    good = np.abs(off) < 0.1
    normals, points = truth.normals[faces][good], world[good] - world[good].mean(axis=0)
    turning = np.einsum("ni,ni->n", normals, np.cross([0.0, 0.0, 1.0], points))
    found = np.linalg.lstsq(np.c_[turning, normals], off[good], rcond=None)[0]
    return float(np.linalg.norm(found[1:])), float(abs(found[0]))


def row(scene: str, seed: int, duration: float) -> str:
    """Simulate, map and compare one flight."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "recording"
        scenario = Scenario(
            scene=scene, seed=seed, duration=duration, gnss="rtk", events=("person",)
        )
        simulate(scenario, folder)
        recording, payload = folder / "recording.bag", folder / "payload.yaml"
        run = map_recording(recording, payload, Path(scratch) / "run", loop_closure=False)
        record = read_record(run.out)
        truth = Truth(folder)
        person, off, still = left_out(folder, scenario, run, truth)
        points = laspy.read(run.out / "map.laz").xyz[:: EVERY * 5]
        shift, heading = offset(points, truth)
        survey(folder / "marks.csv", points, truth)
        settings = GeoreferenceSettings(control_points=folder / "marks.csv")
        again = map_recording(
            recording, payload, Path(scratch) / "again", loop_closure=False, georeferencing=settings
        )
        left = read_record(again.out)["georeference"]["residuals"]
    control, check = left["control"], left["check"]
    cells = [
        f"{scene} {seed}", f"{person:.1%}", f"{off:.0%}", f"{still:.3%}", f"{1e3 * shift:.1f}",
        f"{1e3 * heading:.2f}", f"{1e3 * control['rms']:.1f} ({control['n']})",
        f"{1e3 * check['rms']:.1f} ({check['n']})", f"{1e3 * check['max']:.1f}",
        f"{record['timings']['map']:.1f}",
    ]  # fmt: skip
    return tables.line(cells)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=["courtyard", "office"])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--duration", type=float, default=40.0)
    options = parser.parse_args()
    print(tables.head(COLUMNS))
    for scene in options.scenes:
        for seed in options.seeds:
            print(row(scene, seed, options.duration), flush=True)
