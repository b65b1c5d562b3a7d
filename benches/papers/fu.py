# SPDX-License-Identifier: MIT OR Apache-2.0
"""The algorithms of Fu 2023's Table 2 in any scene, on simulated recordings of several seeds.

These are the Kalman filter with a turning lidar, with a fixed one, and with the rotation ignored, beside
`continuous`. Per scene: mean and RMSE of the ATE over all poses, real-time factor and processor seconds of the
estimate stage (reading included), and whether the errors are as large as stated (NEES). The paper's own
flights are those of `bentwing reproduce fu2023`.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benches.support import tables
from benches.support.axis import about_axis
from bentwing.base import geometry
from bentwing.base.covariances import levelled_covariances
from bentwing.base.mount import FixedMount
from bentwing.evaluate.nees import (
    nees,
    nees_bounds,
    pose_errors_from,
    pose_errors_since,
)
from bentwing.evaluate.simulated import in_flight, true_calibration
from bentwing.evaluate.trajectory import absolute_error
from bentwing.recording import Payload
from bentwing.reproduce.campaign import LOST
from bentwing.reproduce.fu2023 import CONTINUOUS, FIXED, IGNORED, OURS
from bentwing.reproduce.trials import Trial, attempt
from bentwing.simulate import Scenario, simulate

if TYPE_CHECKING:
    from bentwing.base.calibration import Calibration

COLUMNS = (
    "scene", "algorithm", "runs", "failed", "ATE mean, m", "ATE RMSE, m", "worst, m", "way, m",
    "times real time", "CPU s per s", "NEES pose (end)", "NEES position (end)", "NEES since take-off",
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """An algorithm on a head."""

    name: str
    trial: Trial
    head: str


def cases(rate: float) -> list[Case]:
    """The rows of the table for a motor that turns at `rate`, rad/s."""
    motor = "vlp16-motor"
    return [
        Case(f"kalman, {rate:g} rad/s", OURS, motor),
        Case("R-FAST-LIO: rotation ignored", IGNORED, motor),
        Case("F-FAST-LIO: fixed", FIXED, "vlp16-fixed"),
        Case(f"continuous, {rate:g} rad/s", CONTINUOUS, motor),
    ]


def run(case: Case, folder: Path, threads: int) -> dict:
    """Estimate a recording and compare it with its truth."""
    tried = attempt(folder, case.trial, threads)
    if tried.estimate is None:
        return {"failed": True, "why": tried.why}
    truth = tried.truth
    error = absolute_error(tried.estimate.trajectory, truth).position
    way = float(np.linalg.norm(np.diff(truth.positions[::20], axis=0), axis=1).sum())
    row = {"failed": error.rmse > LOST, "mean": error.mean, "rmse": error.rmse}
    speed, cpu = tried.length / tried.seconds, tried.cpu / tried.length
    row |= {"worst": error.maximum, "way": way, "speed": speed, "cpu": cpu}
    if case.trial.estimator == "kalman" and not row["failed"]:
        payload = Payload.load(folder / "payload.yaml")
        truly = true_anchor(tried.engine, truth, true_calibration(folder), payload)
        row |= consistency(tried.engine, tried.estimate, truth, truly)
    return row


def true_anchor(engine, truth, calibration: Calibration, payload: Payload):
    """Where the motor (or the fixed lidar) truly is as the map begins: what the estimate hangs on.

    The zero of the encoder, and what of the lidar's mount is about the axis or along it, are the motor's.
    """
    time, _ = engine.anchor()
    positions, quats = truth.interpolate(np.array([max(time, truth.times[0])]))
    mount = calibration.mount
    if isinstance(mount, FixedMount):
        shift, quat = mount.T_imu_lidar.translation, mount.T_imu_lidar.quaternion
    else:
        believed, axis = payload.encoder.T_motor_lidar, mount.axis
        base, lidar = mount.T_imu_motor, mount.T_motor_lidar
        turn = geometry.multiply(lidar.quaternion, geometry.inverse(np.array(believed.quaternion)))
        about = about_axis(turn, axis)
        along = axis * (axis @ (lidar.translation - np.array(believed.translation)))
        shift = base.translation + geometry.rotate(base.quaternion, along)
        zero = geometry.exp(axis * mount.encoder_zero)
        quat = geometry.multiply(base.quaternion, geometry.multiply(zero, about))
    return geometry.compose(positions[0], quats[0], shift), geometry.multiply(quats[0], quat)


def consistency(engine, estimate, truth, truly) -> dict:
    """NEES of pose and position after the last sweep, and on average over the run.

    Errors are relative to what the map hangs on. `nees_since_take_off` has those of the pose relative to
    the estimate at take-off, whose own error then counts as one of the end.
    """
    times, covariances = engine.pose_covariances()
    take_off, _ = in_flight(truth)
    inside = (times <= estimate.trajectory.times[-1]) & truth.covers(times) & (times > take_off)
    times, covariances = times[inside], covariances[inside]
    _, anchor = engine.anchor()
    hung = anchor.translation, anchor.quaternion
    errors = pose_errors_from(hung, truly, estimate.trajectory, truth, times)
    since = pose_errors_since(take_off, estimate.trajectory, truth, times[-1:])
    positions, _ = estimate.trajectory.interpolate(times)
    std = np.array(estimate.calibration.std["gravity"])
    doubt = levelled_covariances(covariances, positions, std)
    pose, position = nees(errors, doubt), nees(errors[:, 3:], doubt[:, 3:, 3:])
    return {
        "nees": float(pose[-1]),
        "nees_position": float(position[-1]),
        "nees_mean": float(pose.mean()),
        "nees_since_take_off": float(nees(since, doubt[-1:])[0]),
        "errors": errors[-1],
        "std": np.sqrt(np.diag(doubt[-1])),
    }


def row_of(scene: str, case: Case, rows: list[dict]) -> str:
    """One row of the table."""
    good = [row for row in rows if not row["failed"]]
    n_failed = len(rows) - len(good)
    if not good:
        return f"| {scene} | {case.name} | {len(rows)} | {n_failed} |" + " - |" * (len(COLUMNS) - 4)

    def mean(name: str, digits: int) -> str:
        values = [row[name] for row in good if name in row]
        return f"{statistics.fmean(values):.{digits}f}" if values else "-"

    worst = max(row["worst"] for row in good)
    cells = [
        scene, case.name, str(len(rows)), str(n_failed), mean("mean", 4), mean("rmse", 4),
        f"{worst:.3f}", mean("way", 0), mean("speed", 1), mean("cpu", 3), mean("nees", 1),
        mean("nees_position", 1), mean("nees_since_take_off", 1),
    ]  # fmt: skip
    return tables.line(cells)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", nargs="+", default=["office", "courtyard"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3])
    parser.add_argument("--rate", type=float, default=6.2832, help="of the motor, rad/s")
    parser.add_argument("--duration", type=float, default=60.0, help="s")
    parser.add_argument("--only", nargs="+", default=[""], help="algorithms whose names begin so")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--each", action="store_true", help="print every run")
    options = parser.parse_args()
    low, high = nees_bounds(len(options.seeds), 6)
    low3, high3 = nees_bounds(len(options.seeds), 3)
    print(
        f"NEES of honest poses: 6 ({low:.2f} to {high:.2f}), positions: 3 ({low3:.2f} to {high3:.2f})\n"
    )
    print(tables.head(COLUMNS))
    chosen = [c for c in cases(options.rate) if any(c.name.startswith(n) for n in options.only)]
    with tempfile.TemporaryDirectory() as scratch:
        for scene in options.scenes:
            found: dict[str, list[dict]] = {case.name: [] for case in chosen}
            for seed in options.seeds:
                for head in dict.fromkeys(case.head for case in chosen):
                    folder = Path(scratch) / f"{scene}-{head}-{seed}"
                    scenario = Scenario(
                        scene=scene, head=head, motor_rate=options.rate, duration=options.duration, seed=seed
                    )  # fmt: skip
                    simulate(scenario, folder)
                    for case in chosen:
                        if case.head == head:
                            row = run(case, folder, options.threads)
                            found[case.name].append(row)
                            if options.each:
                                print(f"  {scene} {seed} {case.name}: {row}", flush=True)
                    for file in folder.iterdir():
                        file.unlink()
            for case in chosen:
                print(row_of(scene, case, found[case.name]), flush=True)
