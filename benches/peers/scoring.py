# SPDX-License-Identifier: MIT OR Apache-2.0
"""Poses of any engine against the truth of a simulated recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from benches.peers import attitude, scans
from benches.peers.stamps import best_shift, on_truth, pose_stamps
from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory
from bentwing.base.transform import apply
from bentwing.evaluate.trajectory import absolute_error, drift
from bentwing.recording import Payload

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from benches.peers.engines import Engine
    from benches.peers.feed import Feed
    from bentwing.evaluate.simulated import Truth

LEAST_COVERED = 0.5
"""Of the flight; an engine that gives fewer poses has lost its way."""
SHOWN = 1000.0
"""m; how far beyond is no information."""
FEWEST = 10
"""Poses to say anything at all."""


def peer_trajectory(poses: Path, feed: Feed, engine: Engine, origin_ns: int) -> Trajectory | None:
    """Poses of the IMU at the moments they belong to; None of too few."""
    found = np.load(poses)
    stamps = pose_stamps(found["stamps_ns"], feed.head, engine)
    # An engine may repeat itself; the last word counts.
    kept = np.append(np.diff(stamps) > 0, True)
    kept &= np.isfinite(found["positions"]).all(1) & np.isfinite(found["quats_xyzw"]).all(1)
    times, quats = 1e-9 * (stamps[kept] - origin_ns), found["quats_xyzw"][kept]
    if len(times) < FEWEST or (np.diff(times) <= 0).any():
        return None
    if feed.head.kind == "stabilized":
        body = attitude.as_trajectory(1e-9 * (feed.imu.stamps_ns - origin_ns), feed.imu.R_body_imu)
        inside = np.clip(times, body.times[0], body.times[-1])
        quats = geometry.multiply(quats, body.interpolate(inside)[1])
    return Trajectory(times, found["positions"][kept], quats)


def peer_points(estimate: Trajectory, feed: Feed, truth: Truth) -> np.ndarray:
    """The measured points, placed by an engine's poses and, between them, by the gyro."""
    times = 1e-9 * (feed.imu.stamps_ns - truth.origin_ns)
    dense = attitude.densified(estimate, attitude.as_trajectory(times, feed.imu.turned))
    points, stamps = nominally(truth)
    known = dense.covers(stamps)
    return geometry.compose(*dense.interpolate(stamps[known]), points[known])


def nominally(truth: Truth) -> tuple[np.ndarray, np.ndarray]:
    """The points of the best map in the IMU frame by nominal mounts, and their true times, s."""
    payload = Payload.load(truth.folder / "payload.yaml")
    lidar = truth.returns
    times = lidar.times - truth.calibration.latency
    if payload.encoder is None:
        return apply(payload.T_imu_lidar_matrix(), lidar.points), times
    return scans.by_encoder(lidar.points, lidar.angles, payload.encoder), times


def score(estimate: Trajectory | None, truth: Truth, points: Callable[[], np.ndarray]) -> dict:
    """Numbers of merit in SI units, or the reason why there are none under `failure`.

    Parameters
    ----------
    estimate : poses of the IMU
    truth : of the recording
    points : gives the map of the estimate, in its frame
    """
    begin, end = truth.flight
    if estimate is None or _covered(estimate, begin, end) < LEAST_COVERED:
        return {"failure": "lost"}
    known = on_truth(truth.trajectory, estimate.times)
    whole = absolute_error(estimate, known)
    flown = absolute_error(estimate, known, during=truth.flight)
    drifts = drift(estimate, known, during=truth.flight)
    shift, ate_shifted = best_shift(estimate, truth.trajectory, truth.flight)
    found = {
        "ate": whole.position.rmse,
        "ate_flight": flown.position.rmse,
        "rotation": flown.rotation.rmse,
        "horizontal": drifts[0].horizontal_median if drifts else None,
        "vertical": drifts[0].vertical_median if drifts else None,
        "map_std": None,
        "map_ratio": None,
        "clock_left": shift,
        "ate_flight_shifted": ate_shifted,
    }
    if flown.position.rmse > _standing_still(truth):
        astray = flown.position.rmse
        return {**found, "failure": f"lost ({astray:.0f} m)" if astray < SHOWN else "lost"}
    T = flown.alignment
    surface = truth.map_error(points() @ T.R.T + T.t)
    found["map_std"], found["map_ratio"] = surface.std, surface.best_ratio or np.nan
    return found


def _covered(estimate: Trajectory, begin: float, end: float) -> float:
    """Share of the flight between the first and the last pose."""
    first, last = max(begin, estimate.times[0]), min(end, estimate.times[-1])
    return max(0.0, last - first) / (end - begin)


def _standing_still(truth: Truth) -> float:
    """Error of an engine that says nothing but one place, m: worse is lost."""
    times, positions = truth.trajectory.times, truth.trajectory.positions
    flown = positions[(times >= truth.flight[0]) & (times <= truth.flight[1])]
    return float(np.sqrt(np.mean(np.sum((flown - flown.mean(axis=0)) ** 2, axis=1))))
