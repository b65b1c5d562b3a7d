# SPDX-License-Identifier: MIT OR Apache-2.0
"""Pose graphs: our costs and times beside GTSAM's, and what false links do to the positions.

    python -m benches pose_graphs FOLDER [--peer PYTHON] [--graphs sphere2500 …] [--no-false-links]

FOLDER holds the public `.g2o` files. GTSAM (`pip install gtsam`) runs in the interpreter PYTHON,
which needs nothing of ours: Levenberg–Marquardt with its default settings from the file's poses and
from its chordal start; the one with the lower cost counts, with the time of its start, and of equal
ones the faster. Its graph is the one that our reader made, so that both minimize the same
½ Σ rᵀΩr: in cubicle 5021 information matrices are indefinite and become the nearest that are not. Both use
one thread; the repetitions are interleaved.

False links join nodes drawn at random by what a true loop link has measured, 20 for every 100 loop
links. `moved` is the root mean square distance from the positions without false links. The errors are
such distances from the truth, which is known for the two spheres; the other graphs get one: the poses of
the lowest cost are taken for true, and each link is off by as much as it is from these, to one side
or the other by chance. Of several seeds the worst counts, in every column.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benches.support import tables
from bentwing.base import geometry
from bentwing.closing.pose_graph import (
    PoseGraph,
    Solution,
    SolveSettings,
    read_g2o,
    solve_pose_graph,
)
from bentwing.evaluate.alignment import position_error
from bentwing.simulate.pose_graphs import noisy_sphere_positions, with_false_links, with_known_truth

GRAPHS = (
    "smallGrid3D", "parking-garage", "sphere2500", "torus3D", "cubicle", "sphere_bignoise_vertex3",
)  # fmt: skip
COLUMNS = (
    "graph", "nodes", "links", "cost", "GTSAM's", "ratio", "time", "GTSAM's", "ratio",
)  # fmt: skip
FALSE_COLUMNS = (
    "graph", "loop links", "false", "of these believed", "true rejected without", "with", "moved",
    "error without", "with", "ratio", "time",
)  # fmt: skip
BELIEVING = SolveSettings(robust=None)
SAME_COST = 1e-3
PEER = Path(__file__).parents[1] / "peers" / "gtsam_pose_graph.py"


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
    cost = solve_pose_graph(graph, BELIEVING).cost
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
    cells = [
        name, f"{len(graph)}", f"{len(graph.links)}", f"{cost:.8g}", f"{peer_cost:.8g} ({start})",
        f"{cost / peer_cost:.5f}", f"{seconds:.3f} s", f"{peer_seconds:.3f} s", f"{ratio:.2f}",
    ]  # fmt: skip
    print(tables.line(cells), flush=True)


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


def truth_of(name: str, folder: Path) -> np.ndarray | None:
    if name == "sphere_bignoise_vertex3":
        return noisy_sphere_positions()
    path = folder / f"{name}_groundtruth.txt"
    return true_positions(path) if path.exists() else None


@dataclass(frozen=True)
class Disturbed:
    """What false links have done to one graph."""

    n_false: int
    n_missed: int
    n_true_rejected: int
    n_rejected_without: int
    moved: float
    error_without: float
    error_with: float
    seconds: float

    @property
    def ratio(self) -> float:
        return self.error_with / self.error_without


def disturb(graph: PoseGraph, clean: Solution, truth: np.ndarray | None, seed: int) -> Disturbed:
    false, n = with_false_links(graph, 0.2, seed)
    start = time.perf_counter()
    found = solve_pose_graph(false)
    seconds = time.perf_counter() - start
    n_found = int(np.count_nonzero(found.rejected >= len(graph.links)))
    if truth is None:
        known = with_known_truth(graph, seed)
        truth = known.positions
        given = replace(known, positions=graph.positions, quats_xyzw=graph.quats_xyzw)
        solutions = [
            solve_pose_graph(given),
            solve_pose_graph(with_false_links(given, 0.2, seed)[0]),
        ]
    else:
        solutions = [clean, found]
    return Disturbed(
        n,
        n - n_found,
        len(found.rejected) - n_found,
        len(clean.rejected),
        position_error(found.positions, clean.positions),
        *(position_error(solution.positions, truth) for solution in solutions),
        seconds,
    )


def disturb_by_turns(name: str, graph: PoseGraph, folder: Path, seeds: list[int]) -> None:
    truth, clean = truth_of(name, folder), solve_pose_graph(graph)
    runs = [disturb(graph, clean, truth, seed) for seed in seeds]
    worst = max(runs, key=lambda run: run.ratio)
    n_loops = int(np.count_nonzero(~graph.links.trusted))
    cells = [
        name, f"{n_loops}", f"{worst.n_false}", f"{max(r.n_missed for r in runs)}",
        f"{worst.n_rejected_without}", f"{max(r.n_true_rejected for r in runs)}",
        f"{max(r.moved for r in runs):.4f} m", f"{worst.error_without:.4f} m",
        f"{worst.error_with:.4f} m", f"{worst.ratio:.3f}", f"{max(r.seconds for r in runs):.1f} s",
    ]  # fmt: skip
    print(tables.line(cells), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--peer", default=sys.executable, help="interpreter with gtsam")
    parser.add_argument("--graphs", nargs="+", default=GRAPHS)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0], help="of the false links")
    parser.add_argument("--no-false-links", action="store_true")
    parser.add_argument("--only-false-links", action="store_true")
    options = parser.parse_args()
    graphs = {name: read_g2o(options.folder / f"{name}.g2o").graph for name in options.graphs}
    if not options.only_false_links:
        print(tables.head(COLUMNS))
        for name, graph in graphs.items():
            compare(name, graph, options.peer, options.repeats)
    if not options.no_false_links:
        print(f"\n{tables.head(FALSE_COLUMNS)}")
        for name, graph in graphs.items():
            disturb_by_turns(name, graph, options.folder, options.seeds)
