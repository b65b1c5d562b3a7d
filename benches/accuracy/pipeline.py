# SPDX-License-Identifier: MIT OR Apache-2.0
"""From recording to map, as a user runs it: error, speed and memory, one row per recording.

Every recording is simulated, mapped by the command line in a process of its own and compared with
its truth. Prints a table in Markdown and keeps all numbers as JSON.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
from dataclasses import asdict
from itertools import product
from pathlib import Path

import numpy as np

from benches.support import tables
from benches.support.cost import bentwing
from benches.support.tables import given, keep
from bentwing.evaluate.simulated import score

COLUMNS = (
    "scene", "head", "seed", "ATE", "ATE in flight", "drift over 10 m (horizontal, vertical)",
    "map, best possible = 1", "latency", "extrinsics", "speed", "CPU per s recorded", "stages",
    "peak memory",
)  # fmt: skip
STAGES = ("estimate", "loops", "map", "report")
RESULTS = Path(__file__).parent / "results" / "pipeline.json"


def measure(scene: str, head: str, seed: int, options: argparse.Namespace) -> dict:
    """Simulate, map and compare one recording."""
    with tempfile.TemporaryDirectory() as folder:
        simulated, out = Path(folder) / "recording", Path(folder) / "run"
        choices = ["--head", head, "--seed", str(seed), "--duration", f"{options.duration:g}"]
        bentwing("simulate", scene, "-o", simulated, *choices, *varied(options))
        recording, payload = simulated / "recording.bag", simulated / "payload.yaml"
        command = [recording, "--payload", payload, "-o", out, "--quiet"]
        threads = [] if options.threads is None else ["--threads", str(options.threads)]
        loops = ["--no-loop-closure"] if options.no_loop_closure else []
        cost = bentwing("map", *command, *threads, *loops)
        record = json.loads((out / "run.json").read_text())
        return {
            "scene": scene,
            "head": head,
            "seed": seed,
            "duration": options.duration,
            "varied": varied(options),
            "threads": options.threads,
            "no_loop_closure": options.no_loop_closure,
            "version": record["versions"],
            "cost": asdict(cost),
            "timings": record["timings"],
            "warnings": record["warnings"],
            "score": score(simulated, out).as_dict(),
        }


def varied(options: argparse.Namespace) -> list[str]:
    """What makes a recording unlike the scenario's own, as options of `bentwing simulate`."""
    given = [("--event", event) for event in options.event]
    given += [("--motor-rate", options.motor_rate), ("--max-range", options.max_range)]
    return [str(word) for pair in given if pair[1] is not None for word in pair]


def row(result: dict) -> str:
    """One line of the table."""
    found, cost, timings = result["score"], result["cost"], result["timings"]
    drift = ", ".join(given(found[name], 1e3, "mm/m") for name in ("horizontal", "vertical"))
    extrinsics = (
        f"{given(found['extrinsic_rotation'], np.degrees(1.0), '°')}, "
        f"{given(found['extrinsic_translation'], 1e3, 'mm')}"
    )
    shares = ", ".join(
        f"{name} {timings[name] / timings['total']:.0%}" for name in STAGES if name in timings
    )
    cells = [
        result["scene"],
        result["head"],
        str(result["seed"]),
        given(found["ate"], 100, "cm"),
        given(found["ate_flight"], 100, "cm"),
        drift,
        f"{found['map_ratio']:.2f}",
        given(found["latency"], 1e3, "ms"),
        extrinsics,
        f"{result['duration'] / cost['seconds']:.2f} x real time "
        f"(estimate {result['duration'] / timings['estimate']:.2f} x)",
        f"{cost['cpu'] / result['duration']:.2f} s",
        shares,
        f"{cost['megabytes']:.0f} MB",
    ]
    return tables.line(cells)


def honesty(results: list[dict]) -> str:
    """How large the errors of the slow states are in units of their standard deviations."""
    lines = [tables.head(("state", "recordings", "mean squared error over variance, by axis"))]
    states = [result["score"]["normalized"] for result in results]
    for name in sorted(set().union(*states)):
        errors = np.array([state[name] for state in states if name in state])
        squares = ", ".join(f"{mean:.2f}" for mean in np.mean(errors**2, axis=0))
        lines.append(tables.line([name, str(len(errors)), squares]))
    return "\n".join(lines)


def medians(results: list[dict]) -> dict:
    """The middle of several seeds of one scene and head."""
    middle = {**results[0], "seed": f"median of {len(results)}"}
    for part in ("score", "cost", "timings"):
        keys = [key for key, value in results[0][part].items() if not isinstance(value, dict)]
        values = {key: [r[part].get(key) for r in results] for key in keys}
        middle[part] = {
            key: None if None in found else statistics.median(found)
            for key, found in values.items()
        }
    return middle


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("positional", nargs="*", metavar="SCENE", help="the same as --scenes")
    parser.add_argument("--scenes", nargs="+", default=[])
    parser.add_argument("--heads", nargs="+", default=["hokuyo-spin"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0])
    parser.add_argument("--duration", type=float, default=60.0, help="of each flight, in s")
    parser.add_argument("--event", action="append", default=[], help="as of bentwing simulate")
    parser.add_argument("--motor-rate", type=float, help="of vlp16-motor, rad/s")
    parser.add_argument("--max-range", type=float, help="the lidar sees up to here, m")
    parser.add_argument("--threads", type=int, help="of the estimator; default: all cores")
    parser.add_argument("--no-loop-closure", action="store_true", help="the odometry alone")
    parser.add_argument("--json", type=Path, default=RESULTS, help="default: %(default)s")
    options = parser.parse_args()
    scenes = [*options.positional, *options.scenes] or ["courtyard", "office"]
    print(tables.head(COLUMNS))
    results = []
    for scene, head in product(scenes, options.heads):
        of_head = []
        for seed in options.seeds:
            of_head.append(measure(scene, head, seed, options))
            print(row(of_head[-1]), flush=True)
        if len(of_head) > 1:
            print(row(medians(of_head)), flush=True)
        results += of_head
    print(f"\n{honesty(results)}")
    keep({"results": results}, options.json)
