# SPDX-License-Identifier: MIT OR Apache-2.0
"""The experiments of Tazir 2020: a Velodyne turned by a motor beside one that is fixed.

Each flight is simulated with a calibrated head (as in the paper), mapped by `ndt` and `continuous`
in processes of their own, and compared with its truth and with the map that the true poses make.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from cost import python
from scoring import best_points, in_flight, mapped_points, read_scene

from bentwing.estimators.mount import described_mount
from bentwing.estimators.ndt.outcome import calibration_of
from bentwing.evaluate.density import wall_density
from bentwing.evaluate.map import surface_error
from bentwing.evaluate.poses import pose_errors
from bentwing.evaluate.trajectory import absolute_error
from bentwing.map.project import project
from bentwing.preprocess import preprocess
from bentwing.recording import Payload, Recording
from bentwing.trajectory import read_tum

COLUMNS = (
    "flight", "estimator", "way, m", "RTE, mean (max), m", "RRE, mean, °", "ATE, m",
    "registration RMSE, m", "past 1 m after, m", "map ÷ georeferenced", "s per s recorded",
)  # fmt: skip
FAR = 1.0  # m, of RTE: the estimate has left the way


@dataclass(frozen=True)
class Flight:
    """What is flown: scene, head and motor rate (rad/s)."""

    name: str
    scene: str
    head: str
    rate: float
    duration: float


FLIGHTS = (
    Flight("town, 0.5 rad/s", "town", "vlp16-motor", 0.5, 104.0),
    Flight("town, 1 rad/s", "town", "vlp16-motor", 1.0, 104.0),
    Flight("town, fixed", "town", "vlp16-side", 1.0, 104.0),
    Flight("dam, 0.5 rad/s", "dam", "vlp16-motor", 0.5, 62.0),
    Flight("dam, fixed", "dam", "vlp16-side", 1.0, 62.0),
)
WALLS = (
    Flight("fixed", "walls", "vlp16-side", 1.0, 15.0),
    Flight("0.5 rad/s", "walls", "vlp16-motor", 0.5, 15.0),
    Flight("1 rad/s", "walls", "vlp16-motor", 1.0, 15.0),
)


def bentwing(*arguments: str | Path) -> float | None:
    """Run a command; return its seconds, or None where it failed."""
    finished = python("-c", "from bentwing.cli.main import run; run()", *arguments)
    return None if finished.code else finished.cost.seconds


def simulated(flight: Flight, seed: int, folder: Path) -> Path:
    """Simulate a flight with a calibrated head."""
    choices = ["--head", flight.head, "--motor-rate", f"{flight.rate:g}", "--seed", str(seed)]
    choices += ["--flight", "survey", "--calibrated", "--duration", f"{flight.duration:g}"]
    bentwing("simulate", flight.scene, "-o", folder, *choices)
    return folder


def measured(flight: Flight, estimator: str, recording: Path, out: Path) -> dict:
    """Map a flight and compare it with its truth."""
    paths = recording / "recording.bag", "--payload", recording / "payload.yaml"
    wall = bentwing("map", *paths, "-o", out, "--estimator", estimator, "--quiet")
    truth, origin_ns = read_tum(recording / "truth_trajectory.txt")
    row = {"flight": flight.name, "estimator": estimator, "wall": wall}
    if wall is None:
        return row
    record = json.loads((out / "run.json").read_text())
    estimate, _ = read_tum(out / "trajectory.txt", origin_ns)
    errors = pose_errors(estimate, truth)
    aligned = absolute_error(estimate, truth)
    rmse = [w["registration_rmse"] for w in record["windows"] if w.get("registration_rmse")]
    way = np.linalg.norm(np.diff(truth.positions[::20], axis=0), axis=1).cumsum()
    far = np.flatnonzero(errors.rte > FAR)
    return row | {
        "way": float(way[-1]),
        "rte": float(errors.rte.mean()),
        "rte_max": float(errors.rte.max()),
        "rre_deg": float(np.degrees(errors.rre.mean())),
        "ate": aligned.position.rmse,
        "registration_rmse": statistics.fmean(rmse) if rmse else None,
        "lost_after": float(way[min(far[0] // 20, len(way) - 1)]) if len(far) else None,
        "map_ratio": _map_ratio(recording, out, truth, origin_ns, aligned.alignment),
        "wall": record["timings"]["estimate"] / flight.duration,
    }


def _map_ratio(recording, out, truth, origin_ns, alignment) -> float | None:
    """Thickness of the map across the true surfaces, over that of the map from the true poses."""
    flown = in_flight(truth)
    scene = read_scene(recording / "truth_scene.ply")
    points = mapped_points(out / "map.laz", origin_ns, flown)
    placed = scene.distance(np.ascontiguousarray(points @ alignment.R.T + alignment.t))[0]
    best = scene.distance(best_points(recording, truth, origin_ns, flown))[0]
    return surface_error(placed, best=best).best_ratio


def line(row: dict) -> str:
    """One row of the table."""
    if row["wall"] is None:
        return f"| {row['flight']} | {row['estimator']} | failed |" + " - |" * (len(COLUMNS) - 3)

    def shown(value: float | None, digits: int = 3) -> str:
        return "-" if value is None else f"{value:.{digits}f}"

    cells = [
        row["flight"], row["estimator"], shown(row["way"], 0),
        f"{row['rte']:.3f} ({row['rte_max']:.2f})", shown(row["rre_deg"], 2), shown(row["ate"]),
        shown(row["registration_rmse"]), shown(row["lost_after"], 0), shown(row["map_ratio"], 2),
        shown(row["wall"], 2),
    ]  # fmt: skip
    return f"| {' | '.join(cells)} |"


def densities(flight: Flight, folder: Path) -> str:
    """Points per m² in the middle and at the sides of both walls, seen by a lidar that stands still."""
    payload = Payload.load(folder / "payload.yaml")
    with Recording(folder / "recording.bag", payload) as recording:
        truth, _ = read_tum(folder / "truth_trajectory.txt", recording.clock.start_ns)
        batches = list(preprocess(recording.batches(), payload, Counter()))
    chunks = project(batches, truth, calibration_of(described_mount(payload)))
    points = np.concatenate([chunk.points for chunk in chunks])
    cells = [flight.name]
    for axis in (0, 1):
        density = wall_density(points, axis, 10.0, limits=((-8.0, 8.0), (0.5, 9.5)), cell=1.0)
        middle, sides = density[6:10, 3:6], density[[0, 1, -2, -1]]
        cells += [f"{middle.mean():.0f}", f"{sides.mean():.0f}", f"{(density > 0).mean():.2f}"]
    floor = wall_density(points, 2, 0.0, limits=((-9.0, 9.0), (-9.0, 9.0)), cell=1.0)
    return f"| {' | '.join([*cells, f'{(floor > 0).mean():.2f}'])} |"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="+", help="flights whose names begin so", default=[""])
    parser.add_argument("--estimators", nargs="+", default=["ndt", "continuous"])
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        print("Points per m² on the wall across the motor's axis and on the one along it\n")
        names = [f"{wall} {part}" for wall in ("across", "along") for part in ("middle", "sides", "covered")]  # fmt: skip
        print(f"| head | {' | '.join(names)} | floor covered |\n|{'---|' * 8}")
        for number, flight in enumerate(WALLS):
            folder = simulated(flight, options.seed, Path(scratch) / f"walls{number}")
            print(densities(flight, folder), flush=True)
        print(f"\n| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}")
        for number, flight in enumerate(FLIGHTS):
            if not any(flight.name.startswith(name) for name in options.only):
                continue
            recording = simulated(flight, options.seed, Path(scratch) / f"flight{number}")
            for estimator in options.estimators:
                out = Path(scratch) / f"{number}-{estimator}"
                print(line(measured(flight, estimator, recording, out)), flush=True)


if __name__ == "__main__":
    main()
