# SPDX-License-Identifier: MIT OR Apache-2.0
"""How the cost of closing a recording with itself grows with its length.

Parts of one simulated flight, each from its beginning, are closed in processes of their own. The
estimate they start from is the truth with a slow drift of some centimetres put in, so that no time goes
into odometry. Prints a table in Markdown and the power of the length.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benches.support import tables
from benches.support.cost import bentwing
from bentwing.base import geometry
from bentwing.base.estimate import Estimate
from bentwing.base.progress import Progress
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.closing.global_registration import Budget, GlobalSettings, close_loops
from bentwing.evaluate.simulated import true_calibration
from bentwing.evaluate.trajectory import absolute_error
from bentwing.recording import Payload, Recording
from bentwing.recording.preprocess import RecordingPart

if TYPE_CHECKING:
    from bentwing.base.calibration import Calibration

DRIFT = np.array([0.03, -0.02, 0.01])  # m
PERIOD = 170.0  # s
COLUMNS = (
    "length", "drift", "left", "iterations", "unknowns", "surfels", "matches", "surfels made",
    "registered", "processor time", "budget", "peak memory",
)  # fmt: skip


def drifted(truth: Trajectory, start: float, end: float) -> Trajectory:
    """The truth at 100 Hz with a drift of a few centimetres that comes and goes."""
    times = np.arange(start, end, 0.01)
    positions, quats = truth.interpolate(times)
    shape = 1.0 - np.cos(2 * np.pi * (times - start) / PERIOD)
    turn = geometry.exp(shape[:, None] * np.array([0.0, 0.0, 1e-3]))
    return Trajectory(times, positions + shape[:, None] * DRIFT, geometry.multiply(turn, quats))


def slow_states(simulated: Path) -> Calibration:
    """The true ones, without an uncertainty."""
    names = ("latency", "extrinsic_rotation", "extrinsic_translation", "gyro_bias", "accel_bias")
    return replace(true_calibration(simulated, "start"), std={name: [0.0] for name in names})


def close(simulated: Path, seconds: float) -> dict:
    """Close the first seconds of a simulated recording; returns the cells of its row."""
    payload = Payload.load(simulated / "payload.yaml")
    calibration = slow_states(simulated)
    with Recording(next(simulated.glob("recording*")), payload) as recording:
        truth, _ = read_tum(simulated / "truth_trajectory.txt", recording.clock.start_ns)
        start = max(0.1, float(truth.times[0]))
        estimate = Estimate(drifted(truth, start, seconds), calibration)
        part = RecordingPart(recording, payload, None, seconds)
        before = time.process_time()
        with Progress().stage("") as shown:
            batches = part.batches(shown, Counter())
            closed = close_loops(estimate, batches, payload)
    record, flown = closed.record, closed.estimate.trajectory
    budget = Budget.of(seconds, GlobalSettings())
    timings = record["timings"]
    cells = [
        f"{seconds:.0f} s",
        f"{100 * absolute_error(estimate.trajectory, truth).position.rmse:.2f} cm",
        f"{100 * absolute_error(flown, truth).position.rmse:.2f} cm",
        f"{len(record['iterations'])}", f"{record['n_unknowns']}", f"{record['n_surfels']}",
        f"{record['iterations'][-1]['n_matches']}",
        f"{timings['surfels']:.1f} s", f"{timings['register']:.1f} s",
        f"{time.process_time() - before:.1f} s", f"{budget.megabytes:.0f} MB",
        f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB",
    ]  # fmt: skip
    return {"cells": cells, "cost": time.process_time() - before}


def table(simulated: Path, durations: list[float]) -> None:
    """Print a row per length, and how the processor time grows."""
    print(tables.head(COLUMNS))
    costs = []
    for seconds in durations:
        command = [sys.executable, "-m", "benches", "closing_growth"]
        words = ["--recording", str(simulated), "--part", str(seconds)]
        answer = subprocess.run([*command, *words], check=True, stdout=subprocess.PIPE)
        found = json.loads(answer.stdout)
        costs.append(found["cost"])
        print(tables.line(found["cells"]), flush=True)
    if len(durations) > 1:
        power = np.polyfit(np.log(durations), np.log(costs), 1)[0]
        print(f"\nThe processor time grows as length^{power:.2f}.")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="courtyard")
    parser.add_argument("--seed", type=int, default=821)
    parser.add_argument("--durations", nargs="+", type=float, default=[300, 600, 1200, 2400])
    parser.add_argument("--recording", type=Path, help="simulated already")
    parser.add_argument("--part", type=float, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.part is not None:
        print(json.dumps(close(options.recording, options.part)))
        return
    with tempfile.TemporaryDirectory() as folder:
        simulated = options.recording or Path(folder) / "recording"
        if options.recording is None:
            choices = ["--head", "hokuyo-spin", "--seed", options.seed]
            length = ["--duration", max(options.durations)]
            bentwing("simulate", options.scene, "-o", simulated, *choices, *length)
        table(simulated, options.durations)
