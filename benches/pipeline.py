# SPDX-License-Identifier: MIT OR Apache-2.0
"""From recording to map, as a user runs it: error, speed and memory, one row per scenario.

Prints a table in Markdown. Every scenario is simulated, mapped by the command line and compared with
its truth; nothing is read from inside the package, so that any version can be measured.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HEADER = "| scenario | ATE | ATE in open loop | speed | peak memory |\n|---|---|---|---|---|"


@dataclass(frozen=True, slots=True)
class Cost:
    """Wall time in s and peak resident memory in MB of one command."""

    seconds: float
    megabytes: float


def run(*arguments: str | Path) -> Cost:
    """Run one bentwing command; its own output goes to stderr."""
    command = ["-c", "from bentwing.cli.main import run; run()", *map(str, arguments)]
    start = time.perf_counter()
    child = os.posix_spawn(
        sys.executable,
        [sys.executable, *command],
        os.environ,
        file_actions=[(os.POSIX_SPAWN_DUP2, 2, 1)],
    )
    _, status, usage = os.wait4(child, 0)
    if code := os.waitstatus_to_exitcode(status):
        sys.exit(f"bentwing {' '.join(map(str, arguments))}: exit code {code}")
    return Cost(time.perf_counter() - start, usage.ru_maxrss / 1024)


def read_tum(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Times (N,) in epoch seconds, positions (N, 3) in m."""
    rows = [line.split() for line in path.read_text().splitlines() if line and line[0] != "#"]
    # A float resolves epoch seconds to 240 ns: a micrometre at 5 m/s.
    values = np.array(rows, dtype=float)
    return values[:, 0], values[:, 1:4]


def absolute_error(estimate: Path, truth: Path) -> float:
    """RMS distance in m after the rigid motion that fits the estimate to the truth best."""
    times, positions = read_tum(estimate)
    true_times, true_positions = read_tum(truth)
    common = (times >= true_times[0]) & (times <= true_times[-1])
    if not common.any():
        sys.exit(f"{estimate} and {truth} share no time")
    at = np.stack([np.interp(times[common], true_times, axis) for axis in true_positions.T], axis=1)
    a, b = positions[common] - positions[common].mean(axis=0), at - at.mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    handed = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    return float(np.sqrt(np.mean(np.sum((a @ u @ handed @ vt - b) ** 2, axis=1))))


def only(folder: Path, pattern: str) -> Path:
    found = sorted(folder.glob(pattern))
    if len(found) != 1:
        sys.exit(f"{folder}: expected one file {pattern}, found {[path.name for path in found]}")
    return found[0]


def measure(scenario: str, duration: float, folder: Path) -> str:
    """Simulate, map and compare one scenario; return its row of the table."""
    recording, out = folder / scenario, folder / f"{scenario}-run"
    run("simulate", scenario, "-o", recording, "--duration", f"{duration:g}")
    payload = recording / "payload.yaml"
    cost = run("map", only(recording, "*.bag"), "--payload", payload, "-o", out)
    truth = only(recording, "*truth*.txt")
    closed = absolute_error(out / "trajectory.txt", truth)
    open_loop = absolute_error(out / "odometry.txt", truth)
    return (
        f"| {scenario} | {100 * closed:.2f} cm | {100 * open_loop:.2f} cm "
        f"| {duration / cost.seconds:.2f} times real time | {cost.megabytes:.0f} MB |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenarios", nargs="*", default=["courtyard", "office"])
    parser.add_argument("--duration", type=float, default=60.0, help="of each flight, in s")
    arguments = parser.parse_args()
    print(HEADER)
    with tempfile.TemporaryDirectory() as folder:
        for scenario in arguments.scenarios:
            print(measure(scenario, arguments.duration, Path(folder)), flush=True)


if __name__ == "__main__":
    main()
