# SPDX-License-Identifier: MIT OR Apache-2.0
"""What closing a recording with itself gives and costs, one row per flight.

Every flight is simulated, mapped by the command line in a process of its own and compared with its
truth, in open and in closed loop. With several durations the last line says how the cost grows.
Prints Markdown.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from benches.support import tables
from benches.support.cost import bentwing
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.simulated import in_flight, score
from bentwing.evaluate.trajectory import absolute_error

COLUMNS = (
    "scene", "seed", "length", "ATE open", "ATE closed", "in flight open", "in flight closed",
    "map, best possible = 1", "largest correction", "iterations", "unknowns", "matches",
    "surfels again", "registration", "share of the flight", "budget", "peak memory of the run",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Flight:
    """A simulated flight."""

    scene: str
    seed: int
    seconds: float
    head: str


def measured(flight: Flight, folder: Path) -> dict:
    """Simulate and map a flight; returns the cells of its row and what the growth needs."""
    simulated, out = folder / "recording", folder / "run"
    choices = ["--head", flight.head, "--seed", str(flight.seed)]
    length = ["--duration", f"{flight.seconds:g}"]
    bentwing("simulate", flight.scene, "-o", simulated, *choices, *length)
    payload = ["--payload", simulated / "payload.yaml"]
    recording = next(simulated.glob("recording*"))
    peak = bentwing("map", recording, *payload, "-o", out, "--quiet").megabytes
    record = json.loads((out / "run.json").read_text())
    closing, closed = record["loop_closure"], score(simulated, out)
    if not closing["applied"]:
        print(f"not applied: {closing['reason']}", file=sys.stderr)
    truth, origin_ns = read_tum(simulated / "truth_trajectory.txt")
    odometry, _ = read_tum(out / "odometry.txt", origin_ns)
    whole = absolute_error(odometry, truth).position.rmse
    flown = absolute_error(odometry, truth, during=in_flight(truth)).position.rmse
    surfels, register = (closing["timings"][name] for name in ("surfels", "register"))
    cells = [
        flight.scene, f"{flight.seed}", f"{flight.seconds:.0f} s",
        f"{100 * whole:.2f} cm", f"{100 * closed.ate:.2f} cm",
        f"{100 * flown:.2f} cm", f"{100 * closed.ate_flight:.2f} cm",
        f"{closed.map_ratio:.3f}", f"{1e3 * closing['largest_translation']:.1f} mm",
        f"{len(closing['iterations'])}", f"{closing['n_unknowns']}",
        f"{closing['iterations'][-1]['n_matches']}",
        f"{surfels:.1f} s", f"{register:.1f} s",
        f"{(surfels + register) / flight.seconds:.3f}",
        f"{closing['budget']['megabytes']:.0f} MB", f"{peak:.0f} MB",
    ]  # fmt: skip
    return {"cells": cells, "seconds": flight.seconds, "cost": surfels + register}


def growth(results: list[dict]) -> str:
    """Say with which power of the length the cost grows."""
    lengths = np.log([r["seconds"] for r in results])
    power = np.polyfit(lengths, np.log([r["cost"] for r in results]), 1)[0]
    return f"\nThe cost of closing grows as length^{power:.2f}."


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", nargs="+", default=["courtyard", "forest", "cave"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[821])
    parser.add_argument("--durations", nargs="+", type=float, default=[300.0], help="s")
    parser.add_argument("--head", default="hokuyo-spin")
    options = parser.parse_args()
    print(tables.head(COLUMNS))
    results = []
    for scene, seed, seconds in product(options.scenes, options.seeds, options.durations):
        with tempfile.TemporaryDirectory() as folder:
            results.append(measured(Flight(scene, seed, seconds, options.head), Path(folder)))
        print(tables.line(results[-1]["cells"]), flush=True)
    if len(set(options.durations)) > 1:
        print(growth(results))
