# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing calibrate` on simulated stands: errors of angles and shifts after one revolution.

The last line says whether they are as large as stated (normalized errors squared, NEES).
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benches.support import tables
from benches.support.axis import about_axis
from bentwing.base import geometry
from bentwing.calibrate import calibrate
from bentwing.evaluate.nees import nees_bounds
from bentwing.evaluate.simulated import true_calibration
from bentwing.recording import Payload
from bentwing.simulate import Scenario, simulate

if TYPE_CHECKING:
    from bentwing.base.mount import Pose

REST, RAMP = 2.0, 0.35  # s until the motor is up to its rate, and beyond the revolution
COLUMNS = (
    "scene", "seed", "rad/s", "pairs", "angles before, °", "errors after, °", "std, °",
    "errors of shifts, mm", "std, mm", "error of the delay, ms", "std, ms", "NEES angles",
    "NEES shifts",
)  # fmt: skip


def errors(motor, axis, truth: Pose, pose: Pose) -> np.ndarray:
    """Angles, rad, and shifts, m, across the axis by which `pose` is wrong; along it nothing can be."""
    apart = geometry.multiply(pose.quaternion, geometry.inverse(truth.quaternion))
    about = about_axis(apart, axis)
    quat = geometry.multiply(about, truth.quaternion)
    shift = geometry.rotate(about, truth.translation)
    turn = geometry.log(geometry.multiply(pose.quaternion, geometry.inverse(quat)))
    return np.concatenate([motor.across @ turn, motor.across @ (pose.translation - shift)])


def run(scenario: Scenario, folder: Path) -> dict:
    """Simulate, calibrate, compare."""
    files = simulate(scenario, folder)
    payload = Payload.load(files.payload)
    found = calibrate(files.recording, payload)
    files.recording.unlink()
    truth, motor, believed = true_calibration(folder), found.motor, payload.encoder.T_motor_lidar
    axis, mount = truth.mount.axis, truth.mount.T_motor_lidar
    before = errors(motor, axis, mount, believed.pose)
    after = errors(motor, axis, mount, motor.T_motor_lidar)
    parts = [slice(0, 2), slice(2, 4)]
    nees = [after[p] @ np.linalg.solve(motor.covariance[p, p], after[p]) for p in parts]
    delay = motor.delay - truth.latency
    return {
        "before": before, "after": after, "std": motor.std, "delay": delay, "nees": nees,
        "pairs": motor.n_pairs,
    }  # fmt: skip


def row_of(scenario: Scenario, row: dict) -> str:
    """One row of the table."""

    def listed(values, digits: int) -> str:
        return ", ".join(f"{v:.{digits}f}" for v in np.ravel(values))

    cells = [
        scenario.scene, str(scenario.seed), f"{scenario.motor_rate:g}", str(row["pairs"]),
        listed(np.degrees(row["before"][:2]), 3), listed(np.degrees(row["after"][:2]), 4),
        listed(np.degrees(row["std"][:2]), 4), listed(1e3 * row["after"][2:], 2),
        listed(1e3 * row["std"][2:4], 2), listed(1e3 * row["delay"], 2),
        listed(1e3 * row["std"][4], 2), *(f"{n:.1f}" for n in row["nees"]),
    ]  # fmt: skip
    return tables.line(cells)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", nargs="+", default=["office"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3], help="of each scene")
    parser.add_argument("--rate", type=float, default=2.0, help="of the motor, rad/s")
    parser.add_argument("--both-ways", action="store_true", help="a revolution in each direction")
    options = parser.parse_args()
    turn = 2 * np.pi / options.rate + RAMP
    duration, events = REST + turn, ()
    if options.both_ways:
        duration, events = 2 * (REST + turn), ("motor-reversal",)
    print(tables.head(COLUMNS))
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        for scene in options.scenes:
            for seed in options.seeds:
                scenario = Scenario(
                    scene=scene, head="vlp16-motor", flight="stand", motor_rate=options.rate,
                    duration=round(duration, 2), seed=seed, events=events,
                )  # fmt: skip
                rows.append(run(scenario, Path(scratch) / f"{scene}-{seed}"))
                print(row_of(scenario, rows[-1]), flush=True)
    worst = np.degrees(np.max([np.abs(row["after"][:2]) for row in rows]))
    low, high = nees_bounds(len(rows), 2)
    angles, shifts = np.mean([row["nees"] for row in rows], axis=0)
    print(
        f"\nworst angle {worst:.4f}°; NEES of angles {angles:.2f}, of shifts {shifts:.2f}", end=""
    )
    print(f" (honest: 2, {low:.2f} to {high:.2f})")
