# SPDX-License-Identifier: MIT OR Apache-2.0
"""What real sensors' errors do to the trajectory and the map, one group of errors at a time.

Every flight is simulated with each group at each level, and with all of them, mapped by the command
line and compared with its truth. Prints a table in Markdown, the median of the seeds in each row.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
from itertools import product
from pathlib import Path
from typing import get_args

from benches.support import tables
from benches.support.cost import bentwing
from benches.support.tables import given, keep
from bentwing.evaluate.simulated import score
from bentwing.simulate.names import RealismGroup

COLUMNS = (
    "scene", "head", "group", "level", "ATE", "ATE in flight", "horizontal drift", "vertical",
    "map", "map / best", "latency", "extrinsics",
)  # fmt: skip
RESULTS = Path(__file__).parent / "results" / "realism.json"


def measure(
    scene: str, head: str, seed: int, chosen: tuple[str, float], options: argparse.Namespace
) -> dict:
    """Simulate, map and compare one recording."""
    group, level = chosen
    only = [] if group in ("none", "all") else ["--realism-only", group]
    choices = ["--head", head, "--seed", seed, "--duration", options.duration, "--quiet"]
    with tempfile.TemporaryDirectory() as folder:
        simulated, out = Path(folder) / "recording", Path(folder) / "run"
        bentwing("simulate", scene, "-o", simulated, *choices, "--realism", level, *only)
        recording, payload = simulated / "recording.bag", simulated / "payload.yaml"
        bentwing("map", recording, "--payload", payload, "-o", out, "--quiet")
        return score(simulated, out).as_dict()


def row(scene: str, head: str, chosen: tuple[str, float], scores: list[dict]) -> str:
    """One line of the table: the median of the seeds."""

    def middle(name: str) -> float | None:
        values = [found[name] for found in scores]
        return None if None in values else statistics.median(values)

    cells = [
        scene,
        head,
        chosen[0],
        f"{chosen[1]:g}",
        given(middle("ate"), 100, "cm"),
        given(middle("ate_flight"), 100, "cm"),
        *(given(middle(name), 1e3, "mm/m") for name in ("horizontal", "vertical")),
        given(middle("map_std"), 1e3, "mm"),
        given(middle("map_ratio"), 1, ""),
        given(middle("latency"), 1e3, "ms"),
        given(middle("extrinsic_rotation"), 57.29578, "°"),
    ]
    return tables.line(cells)


def main() -> None:
    """Print the table."""
    groups = ("none", *get_args(RealismGroup), "all")
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", nargs="+", default=["courtyard"])
    parser.add_argument("--heads", nargs="+", default=["hokuyo-spin"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[101, 102, 103])
    parser.add_argument("--groups", nargs="+", choices=groups, default=groups, help="default: all")
    parser.add_argument("--levels", nargs="+", type=float, default=[1.0, 3.0])
    parser.add_argument("--duration", type=float, default=40.0, help="of each flight, in s")
    parser.add_argument("--json", type=Path, default=RESULTS, help="default: %(default)s")
    options = parser.parse_args()
    print(tables.head(COLUMNS))
    results = []
    wanted = [("none", 0.0)] if "none" in options.groups else []
    wanted += product([g for g in options.groups if g != "none"], options.levels)
    for scene, head, chosen in product(options.scenes, options.heads, wanted):
        scores = [measure(scene, head, seed, chosen, options) for seed in options.seeds]
        print(row(scene, head, chosen, scores), flush=True)
        results.append({"scene": scene, "head": head, "chosen": chosen, "scores": scores})
    keep({"seeds": options.seeds, "duration": options.duration, "results": results}, options.json)
