# SPDX-License-Identifier: MIT OR Apache-2.0
"""What merging gives and costs: flights in one world, put together without a guess.

    python -m benches merging --scenes office courtyard --seeds 841 842
    python -m benches merging --scenes courtyard --seeds 843 --flights 3 --duration 540

Flights are simulated, mapped and merged by the command line, each in a process of its own. With
--apart, flights in worlds of neighbouring seeds are merged, too, which should stay apart. With --stall S
a flight is cut by a stall of S seconds in which its IMU is knocked. Prints Markdown.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from contextlib import nullcontext
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from benches.support import tables
from benches.support.cost import bentwing
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.simulated import in_flight, merged_score
from bentwing.evaluate.trajectory import absolute_error
from bentwing.simulate.knock import knocked

COLUMNS = (
    "scene", "seed", "flights", "length of each", "points", "links", "rejected", "between by places",
    "between in the end", "ATE, each by itself", "ATE, all as one", "map, best possible = 1",
    "mapping", "merging", "its processor time", "merging over flying", "peak memory",
)  # fmt: skip
STALL_COLUMNS = (
    "scene", "seed", "stall", "segments", "links", "after the stall, open loop", "merged", "ATE merged",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Flight:
    """A simulated flight and its run."""

    recording: Path
    run: Path


def flown(scene: str, seed: int, number: int, options: argparse.Namespace, folder: Path) -> Flight:
    """Simulate and map a flight, unless it was kept."""
    name = f"{scene}_{seed}_{number}_{options.duration:g}"
    flight = Flight(folder / f"{name}_recording", folder / f"{name}_run")
    if not flight.recording.exists():
        choices = ["--seed", str(seed), "--flight-seed", str(100 * seed + number)]
        choices += ["--duration", f"{options.duration:g}"]
        bentwing("simulate", scene, "-o", flight.recording, *choices)
    if not (flight.run / "map.laz").exists():
        mapped(flight.recording / "recording.bag", flight.recording, flight.run)
    return flight


def mapped(recording: Path, simulated: Path, out: Path) -> None:
    payload = simulated / "payload.yaml"
    bentwing("map", recording, "--payload", payload, "-o", out, "--quiet")


def together(scene: str, seed: int, options: argparse.Namespace, folder: Path) -> None:
    """Merge the flights in one world, and print a row."""
    flights = [flown(scene, seed, k, options, folder) for k in range(1, options.flights + 1)]
    out = folder / f"{scene}_{seed}_merged"
    cost = bentwing("merge", *(f.run for f in flights), "-o", out, "--quiet")
    record = json.loads((out / "run.json").read_text())
    maps = record["merging"]["maps"]
    seconds = options.flights * options.duration
    if len(maps) > 1:
        print(tables.line([scene, f"{seed}", f"apart: {[m['runs'] for m in maps]}"]), flush=True)
        return
    score = merged_score([f.recording for f in flights], out)
    mapping = sum(json.loads((f.run / "run.json").read_text())["timings"]["total"] for f in flights)
    cells = [
        scene, f"{seed}", f"{options.flights}", f"{options.duration:.0f} s",
        f"{record['counts']['map.points'] / 1e6:.1f} M",
        f"{maps[0]['n_links']}", f"{maps[0]['graph']['n_rejected']}",
        f"{1e3 * score.before:.1f} mm", f"{1e3 * score.after:.1f} mm",
        ", ".join(f"{1e3 * ate:.1f}" for ate in score.ates) + " mm",
        f"{1e3 * score.joint:.1f} mm", f"{score.map_ratio:.3f}",
        f"{mapping:.0f} s", f"{cost.seconds:.0f} s", f"{cost.cpu:.0f} s",
        f"{cost.seconds / seconds:.2f}",
        f"{cost.megabytes:.0f} MB",
    ]  # fmt: skip
    print(tables.line(cells), flush=True)


def apart(scene: str, seeds: tuple[int, int], options: argparse.Namespace, folder: Path) -> None:
    """Merge flights in two worlds, and say whether they stayed apart."""
    flights = [flown(scene, seed, 1, options, folder) for seed in seeds]
    out = folder / f"{scene}_{seeds[0]}_{seeds[1]}_apart"
    bentwing("merge", *(f.run for f in flights), "-o", out, "--quiet")
    maps = json.loads((out / "run.json").read_text())["merging"]["maps"]
    verdict = "kept apart" if len(maps) == 2 else "MERGED"
    print(f"{scene} {seeds[0]} and {seeds[1]}: {verdict}", flush=True)


def stalled(scene: str, seed: int, options: argparse.Namespace, folder: Path) -> None:
    """Map a flight with a stall that its estimate does not survive, and print a row."""
    simulated, out = folder / f"{scene}_{seed}_stall", folder / f"{scene}_{seed}_stall_run"
    choices = ["--seed", str(seed), "--duration", f"{options.duration:g}"]
    choices += ["--event", "spin-stall", "--stall", f"{options.stall:g}"]
    if not simulated.exists():
        bentwing("simulate", scene, "-o", simulated, *choices)
    start = 0.55 * options.duration + 0.35 * options.stall
    bag = simulated / "knocked.bag"
    if not bag.exists():
        knocked(simulated / "recording.bag", bag, (start, start + 2.0))
    mapped(bag, simulated, out)
    record = json.loads((out / "run.json").read_text())
    segments = record["segments"]
    links = [c for c in (record["merging"] or {}).get("candidates", []) if c["accepted"]]
    truth, origin_ns = read_tum(simulated / "truth_trajectory.txt")
    first, last = in_flight(truth)
    flight = [(max(a, first), min(b, last) - 0.1) for a, b in segments]
    flight = [(a + (0.5 if k else 0.0), b) for k, (a, b) in enumerate(flight)]
    errors = []
    for name in ("odometry.txt", "trajectory.txt"):
        estimate, _ = read_tum(out / name, origin_ns)
        aligned = absolute_error(estimate, truth.within(flight[:1])).alignment
        behind = truth.within(flight[1:] or flight)
        ours = estimate.interpolate(behind.times)[0] @ aligned.R.T + aligned.t
        errors.append(np.sqrt(((ours - behind.positions) ** 2).sum(axis=1).mean()))
    ate = absolute_error(read_tum(out / "trajectory.txt", origin_ns)[0], truth.within(flight))
    cells = [
        scene, f"{seed}", f"{options.stall:g} s", f"{len(segments)}", f"{len(links)}",
        f"{errors[0]:.3f} m", f"{1e3 * errors[1]:.1f} mm", f"{1e3 * ate.position.rmse:.1f} mm",
    ]  # fmt: skip
    print(tables.line(cells), flush=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="+", default=["office", "courtyard"])
    parser.add_argument("--seeds", nargs="+", type=int, required=True)
    parser.add_argument("--flights", type=int, default=2)
    parser.add_argument("--duration", type=float, default=60.0, help="of each flight, s")
    parser.add_argument("--apart", action="store_true", help="merge different worlds as well")
    parser.add_argument("--stall", type=float, help="s; instead of merging flights")
    parser.add_argument("--keep", type=Path, help="keep everything here, and use what is kept")
    options = parser.parse_args()
    columns = COLUMNS if options.stall is None else STALL_COLUMNS
    print(tables.head(columns), flush=True)
    keeping = tempfile.TemporaryDirectory() if options.keep is None else nullcontext(options.keep)
    with keeping as name:
        folder = Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        for scene in options.scenes:
            for seed in options.seeds:
                (together if options.stall is None else stalled)(scene, seed, options, folder)
            if options.apart and options.stall is None:
                for seeds in pairwise(options.seeds):
                    apart(scene, seeds, options, folder)
