# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a run says of its errors, beside its errors."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from bentwing import odometry
from bentwing.base.covariances import short_pairs
from bentwing.base.progress import Progress
from bentwing.base.trajectory import read_tum
from bentwing.closing.global_registration import close_loops
from bentwing.evaluate.expected import expected_accuracy
from bentwing.evaluate.nees import normalized_pose_errors, pose_errors_since
from bentwing.evaluate.simulated import in_flight
from bentwing.recording import Payload, Recording
from bentwing.recording.preprocess import RecordingPart

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.estimate import Estimate
    from bentwing.base.trajectory import Trajectory


def compared(folder: Path) -> dict[str, dict]:
    """Estimate a simulated flight without and with its loops closed, and compare with its truth.

    Returns
    -------
    `open` and `closed`, each with `normalized`, the errors (K, 6) of poses in flight over their standard
    deviations, and `expected`, by figure of the expected accuracy, true errors over it; or `failure`
    """
    payload = Payload.load(folder / "payload.yaml")
    engine, shown = odometry.create("continuous", payload), Progress().stage("", 0.0)
    with shown as stage, Recording([folder / "recording.bag"], payload) as recording:
        part = RecordingPart(recording, payload)
        for batch in part.batches(stage, Counter()):
            engine.feed(batch)
        opened = engine.result()
        closed = close_loops(opened, part.batches(stage, Counter()), payload)
        truth, _ = read_tum(folder / "truth_trajectory.txt", recording.clock.start_ns)
    found = {"open": _compared(opened, payload, truth)}
    if closed.record["applied"]:
        found["closed"] = _compared(closed.estimate, payload, truth)
    else:
        found["closed"] = {"failure": str(closed.record["reason"])}
    return found


def _compared(estimate: Estimate, payload: Payload, truth: Trajectory) -> dict:
    stated = expected_accuracy(estimate, payload.lidar.range_sigma)
    if estimate.covariances is None or stated is None:
        return {"failure": "there are no covariances"}
    span = in_flight(truth)
    normalized = normalized_pose_errors(estimate.trajectory, estimate.covariances, truth, span)
    ratios = {
        name: (errors / getattr(stated, name)).round(4).tolist()
        for name, errors in true_errors(estimate, truth).items()
    }
    return {"normalized": normalized.round(4).tolist(), "expected": ratios}


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
