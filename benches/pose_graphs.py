# SPDX-License-Identifier: MIT OR Apache-2.0
"""Pose graphs: our costs and times beside GTSAM's, and what false links do to the positions.

    python benches/pose_graphs.py FOLDER [--peer PYTHON] [--graphs sphere2500 …] [--no-false-links]

FOLDER holds the public `.g2o` files. GTSAM (`pip install gtsam`) runs in the interpreter PYTHON,
which needs nothing of ours: Levenberg–Marquardt with its default settings from the file's poses and
from its chordal start; the one with the lower cost counts, with the time of its start, and of equal
ones the faster. Its graph is the one that our reader made, so that both minimize the same
½ Σ rᵀΩr: in cubicle 5021 information matrices are indefinite and become the nearest that are not. Both use
one thread; the repetitions are interleaved.

False links join nodes drawn at random by what a true loop link has measured. The error is the root
mean square distance after alignment to the truth where there is one, else to the positions of the
lowest cost of the graph without false links.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from false_links import position_error, with_false_links

from bentwing import geometry
from bentwing.pose_graph import PoseGraph, SolveSettings, read_g2o, solve

GRAPHS = (
    "smallGrid3D", "parking-garage", "sphere2500", "torus3D", "cubicle", "sphere_bignoise_vertex3",
)  # fmt: skip
BELIEVING = SolveSettings(robust=None)
SAME_COST = 1e-3
PEER = Path(__file__).parent / "peers" / "gtsam_pose_graph.py"


class Peer:
    """GTSAM in a process of its own, which solves the graph whenever it is asked to."""

    def __init__(self, python: str, graph: PoseGraph) -> None:
        links = graph.links
        with tempfile.NamedTemporaryFile(suffix=".npz") as file:
            np.savez(
                file,
                positions=graph.positions,
                quats_xyzw=graph.quats_xyzw,
                nodes=links.nodes,
                measured_positions=links.positions,
                measured_quats_xyzw=links.quats_xyzw,
                information=links.information,
            )
            file.flush()
            self._process = subprocess.Popen(
                [python, str(PEER), file.name],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
            self.starts: list[str] = self._answer()

    def run(self, start: str) -> tuple[float, float]:
        """Cost and seconds; an infinite cost where it failed."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{start}\n")
        self._process.stdin.flush()
        cost, seconds = self._answer()
        return cost, seconds

    def close(self) -> None:
        self._process.communicate()

    def _answer(self):
        assert self._process.stdout is not None
        return json.loads(self._process.stdout.readline())


def ours(graph: PoseGraph) -> tuple[float, float]:
    start = time.perf_counter()
    cost = solve(graph, BELIEVING).cost
    return cost, time.perf_counter() - start


def compare(name: str, graph: PoseGraph, python: str, repeats: int) -> None:
    peer = Peer(python, graph)
    first = {start: peer.run(start) for start in peer.starts}
    lowest = min(cost for cost, _ in first.values())
    equal = [s for s, (cost, _) in first.items() if cost <= lowest * (1 + SAME_COST)]
    start = min(equal, key=lambda s: first[s][1])
    runs = [(ours(graph), peer.run(start)) for _ in range(repeats)]
    peer.close()
    (cost, _), (peer_cost, _) = runs[0]
    seconds = statistics.median(mine for (_, mine), _ in runs)
    peer_seconds = statistics.median(theirs for _, (_, theirs) in runs)
    ratio = statistics.median(mine / theirs for (_, mine), (_, theirs) in runs)
    print(
        f"| {name} | {len(graph)} | {len(graph.links)} | {cost:.8g} | {peer_cost:.8g} ({start}) "
        f"| {cost / peer_cost:.5f} | {seconds:.3f} s | {peer_seconds:.3f} s | {ratio:.2f} |",
        flush=True,
    )


def true_positions(path: Path) -> np.ndarray:
    """Positions along the exact odometry `EDGE3 from to x y z roll pitch yaw …`."""
    rows = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
    steps = [[float(v) for v in r[3:9]] for r in rows if int(r[2]) == int(r[1]) + 1]
    position, turn = np.zeros(3), np.array(geometry.IDENTITY_QUAT_XYZW)
    positions = [position]
    for step in np.array(steps):
        position = position + geometry.rotate(turn, step[:3])
        for axis in (2, 1, 0):
            turn = geometry.multiply(turn, geometry.exp(np.eye(3)[axis] * step[3 + axis]))
        positions.append(position)
    return np.array(positions)


def disturb(name: str, graph: PoseGraph, truth: np.ndarray | None, seed: int) -> None:
    reference = solve(graph, BELIEVING).positions if truth is None else truth
    clean = solve(graph)
    false, n = with_false_links(graph, 0.2, seed)
    start = time.perf_counter()
    found = solve(false)
    seconds = time.perf_counter() - start
    n_loops = int(np.count_nonzero(~graph.links.trusted))
    n_rejected = np.count_nonzero(found.rejected >= len(graph.links))
    errors = [position_error(s.positions, reference) for s in (clean, found)]
    extent = np.ptp(reference, axis=0).max()
    print(
        f"| {name} | {n_loops} | {n} | {n_rejected} | {len(found.rejected) - n_rejected} "
        f"| {extent:.0f} m | {errors[0]:.4f} m | {errors[1]:.4f} m | {seconds:.1f} s |",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--peer", default=sys.executable, help="interpreter with gtsam")
    parser.add_argument("--graphs", nargs="+", default=GRAPHS)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--no-false-links", action="store_true")
    parser.add_argument("--only-false-links", action="store_true")
    options = parser.parse_args()
    graphs = {name: read_g2o(options.folder / f"{name}.g2o").graph for name in options.graphs}
    if not options.only_false_links:
        print("| graph | nodes | links | cost | GTSAM's | ratio | time | GTSAM's | ratio |")
        print("|---|---|---|---|---|---|---|---|---|")
        for name, graph in graphs.items():
            compare(name, graph, options.peer, options.repeats)
    if not options.no_false_links:
        print(
            "\n| graph | loop links | false | false rejected | true rejected | extent "
            "| error without | error with | time |\n|---|---|---|---|---|---|---|---|---|"
        )
        for name, graph in graphs.items():
            path = options.folder / f"{name}_groundtruth.txt"
            truth = true_positions(path) if path.exists() else None
            disturb(name, graph, truth, options.seed)


if __name__ == "__main__":
    main()
