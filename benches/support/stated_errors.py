# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a run says of its errors, beside its errors."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from bentwing import odometry
from bentwing.base import geometry
from bentwing.base.covariances import short_pairs
from bentwing.base.mount import FixedMount
from bentwing.base.progress import Progress
from bentwing.base.trajectory import read_tum
from bentwing.closing.beams import find_beams
from bentwing.closing.global_registration import close_loops
from bentwing.evaluate.expected import expected_accuracy
from bentwing.evaluate.nees import normalized_pose_errors, pose_errors_since
from bentwing.evaluate.simulated import Truth, in_flight
from bentwing.evaluate.simulated.unit import in_frame_of
from bentwing.recording import Payload, Recording
from bentwing.recording.preprocess import RecordingPart

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.calibration import Calibration
    from bentwing.base.estimate import Estimate
    from bentwing.base.mount import Mount, Pose
    from bentwing.base.trajectory import Trajectory
    from bentwing.closing.global_registration import Closed


def compared(folder: Path) -> dict[str, dict]:
    """Estimate a simulated flight without and with its loops closed, and compare with its truth.

    Returns
    -------
    `open` and `closed`, each with `normalized`, the errors (K, 6) of poses in flight over their standard
    deviations, `calibration`, the same of slow states by their names, and `expected`, by figure of the
    expected accuracy, true errors over it; or `failure`
    """
    payload = Payload.load(folder / "payload.yaml")
    opened, closed, start_ns = estimated(folder / "recording.bag", payload)
    truth = Truth(folder)
    trajectory, _ = read_tum(folder / "truth_trajectory.txt", start_ns)
    found = {"open": _compared(opened, payload, truth, trajectory)}
    if closed.record["applied"]:
        found["closed"] = _compared(closed.estimate, payload, truth, trajectory)
    else:
        found["closed"] = {"failure": str(closed.record["reason"])}
    return found


def estimated(bag: Path, payload: Payload) -> tuple[Estimate, Closed, int]:
    """Estimate a recording as `map` does: again where beams are found to be off, and with loops closed.

    Returns
    -------
    The open loop, what became of it, and the recording's start, ns UTC
    """
    engine, shown = odometry.create("continuous", payload), Progress().stage("", 0.0)
    with shown as stage, Recording([bag], payload) as recording:
        part = RecordingPart(recording, payload)
        for batch in part.batches(stage, Counter()):
            engine.feed(batch)
        opened = engine.result()
        if payload.lidar.beams is None:
            beams = find_beams(opened, part.batches(stage, Counter()), payload)
            if beams is not None and beams.matters:
                return estimated(bag, beams.in_payload(payload))
        closed = close_loops(opened, part.batches(stage, Counter()), payload)
        return opened, closed, recording.clock.start_ns


def _compared(estimate: Estimate, payload: Payload, truth: Truth, trajectory: Trajectory) -> dict:
    stated = expected_accuracy(estimate, payload.lidar.range_sigma)
    if estimate.covariances is None or stated is None:
        return {"failure": "there are no covariances"}
    span = in_flight(trajectory)
    normalized = normalized_pose_errors(estimate.trajectory, estimate.covariances, trajectory, span)
    ratios = {
        name: (errors / getattr(stated, name)).round(4).tolist()
        for name, errors in true_errors(estimate, trajectory).items()
    }
    calibration = {
        name: (errors / estimate.calibration.std[name]).round(4).tolist()
        for name, errors in calibration_errors(estimate.calibration, truth).items()
        if name in estimate.calibration.std
    }
    return {
        "normalized": normalized.round(4).tolist(),
        "calibration": calibration,
        "expected": ratios,
    }


def calibration_errors(found: Calibration, truth: Truth) -> dict[str, NDArray[np.float64]]:
    """Errors of latency, mount and gyro bias, by the names that their standard deviations have.

    The mount is that on the unit's housing. Biases are those that the unit has under the force at the
    start, see `in_frame_of`.
    """
    true = truth.calibration
    pose, true_pose = (_on_imu(of.mount) for of in (found, true))
    turn = geometry.multiply(pose.quaternion, geometry.inverse(true_pose.quaternion))
    unit = in_frame_of(found, true, truth.imu_response)
    return {
        "latency": np.array([found.latency - true.latency]),
        "extrinsic_rotation": geometry.log(turn[None])[0],
        "extrinsic_translation": pose.translation - true_pose.translation,
        "gyro_bias": found.gyro_bias - unit.gyro_bias,
    }


def _on_imu(mount: Mount) -> Pose:
    """Return where the lidar, or the motor, is on the IMU."""
    return mount.T_imu_lidar if isinstance(mount, FixedMount) else mount.T_imu_motor


def true_errors(of: Estimate, truth: Trajectory) -> dict[str, NDArray[np.float64]]:
    """Sizes of the errors that the expected accuracy is about: where it is least certain, and over ten
    metres of path in flight."""
    estimate, covariances = of.trajectory, of.covariances
    assert covariances is not None
    first = max(float(estimate.times[0]), float(truth.times[0]))
    last = min(float(estimate.times[-1]), float(truth.times[-1]))
    times = covariances.times[(covariances.times >= first) & (covariances.times <= last)]
    variances = np.einsum("kii->ki", covariances.at(times))
    worst = [
        int(np.argmax(v)) for v in (variances[:, 3:5].sum(axis=1), variances[:, 5], variances[:, 2])
    ]
    errors = pose_errors_since(first, estimate, truth, times[np.unique(worst)])
    by_time = dict(zip(np.unique(worst).tolist(), errors, strict=True))
    return {
        "horizontal": np.array([np.linalg.norm(by_time[worst[0]][3:5])]),
        "vertical": np.array([abs(by_time[worst[1]][5])]),
        "heading": np.array([abs(by_time[worst[2]][2])]),
    } | _short_errors(estimate, truth, times)


def _short_errors(
    estimate: Trajectory, truth: Trajectory, times: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    positions = estimate.interpolate(times)[0]
    found = [
        pose_errors_since(times[a], estimate, truth, times[b : b + 1])[0]
        for a, b in short_pairs(times, positions).tolist()
    ]
    errors = np.array(found).reshape(-1, 6)
    return {
        "horizontal_per_10m": np.linalg.norm(errors[:, 3:5], axis=1),
        "vertical_per_10m": np.abs(errors[:, 5]),
        "heading_per_10m": np.abs(errors[:, 2]),
    }
