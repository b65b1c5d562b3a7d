# SPDX-License-Identifier: MIT OR Apache-2.0
"""A run folder against the truth of its simulated recording: the numbers that benches and tests share."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import laspy
import numpy as np
import yaml

from bentwing._core import Scene
from bentwing.base import geometry
from bentwing.base.errors import InputError
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.evaluate.map import surface_error
from bentwing.evaluate.trajectory import absolute_error, drift
from bentwing.map.gps_time import adjusted_gps_origin
from bentwing.map.read_mesh import read_mesh
from bentwing.recording import LidarBatch, Payload, Recording
from bentwing.recording.preprocess import preprocess

if TYPE_CHECKING:
    from pathlib import Path

MOVED = 0.1  # m from the first place: in flight
MAP_SAMPLE = 100_000  # points whose distances are measured


@dataclass(frozen=True, slots=True)
class Score:
    """Errors of one run.

    Attributes
    ----------
    ate, ate_flight, worst : m; of all poses, in flight, and the largest in flight
    rotation : rad, root mean square in flight without the constant rotation of the IMU frame
    tilt : rad, of the map against gravity
    horizontal, vertical : m per m, median drift over 10 m in flight; None where it is shorter
    map_std, map_ratio : m; and over that of the map made with the truth
    map_excluded : share of points on no surface
    latency : s
    extrinsic_rotation, extrinsic_translation : rad, m
    gyro_bias, accel_bias : rad/s, m/s², against the truth at the end
    normalized : errors of the slow states over their stated standard deviations, by axis
    """

    ate: float
    ate_flight: float
    worst: float
    rotation: float
    tilt: float
    horizontal: float | None
    vertical: float | None
    map_std: float
    map_ratio: float
    map_excluded: float
    latency: float
    extrinsic_rotation: float | None
    extrinsic_translation: float | None
    gyro_bias: float
    accel_bias: float
    normalized: dict[str, list[float]]

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def score(simulated: Path, run: Path) -> Score:
    """Compare what `bentwing map` left in `run` with the truth in the folder `simulated`."""
    record = json.loads((run / "run.json").read_text())
    truth, origin_ns = read_tum(simulated / "truth_trajectory.txt")
    estimate, _ = read_tum(run / "trajectory.txt", origin_ns)
    true = yaml.safe_load((simulated / "truth_calibration.yaml").read_text())
    flight = in_flight(truth)
    whole, flown = absolute_error(estimate, truth), absolute_error(estimate, truth, during=flight)
    drifts = drift(estimate, truth, during=flight)
    R = flown.alignment.R
    points = mapped_points(run / "map.laz", origin_ns, flight)
    scene = read_scene(simulated / "truth_scene.ply")
    placed = scene.distance(np.ascontiguousarray(points @ R.T + flown.alignment.t))[0]
    best = scene.distance(best_points(simulated, truth, origin_ns, flight))[0]
    error = surface_error(placed, best=best)
    found = record["calibration"]
    errors = calibration_errors(found, true)
    return Score(
        ate=whole.position.rmse,
        ate_flight=flown.position.rmse,
        worst=flown.position.maximum,
        rotation=flown.rotation.rmse,
        tilt=float(np.arccos(np.clip(R[2, 2], -1.0, 1.0))),
        horizontal=drifts[0].horizontal_median if drifts else None,
        vertical=drifts[0].vertical_median if drifts else None,
        map_std=error.std,
        map_ratio=error.best_ratio or np.nan,
        map_excluded=error.n_excluded / error.n_points,
        latency=float(errors["latency"][0]),
        extrinsic_rotation=_norm(errors.get("extrinsic_rotation")),
        extrinsic_translation=_norm(errors.get("extrinsic_translation")),
        gyro_bias=float(np.linalg.norm(errors["gyro_bias"])),
        accel_bias=float(np.linalg.norm(errors["accel_bias"])),
        normalized={
            name: np.divide(error, found["std"][name]).tolist()
            for name, error in errors.items()
            if name in found["std"]
        },
    )


def in_flight(truth: Trajectory) -> tuple[float, float]:
    """From the first to the last time away from the first place, s."""
    away = np.linalg.norm(truth.positions - truth.positions[0], axis=1) > MOVED
    if not away.any():
        msg = "the truth does not move"
        raise InputError(msg)
    return float(truth.times[away][0]), float(truth.times[away][-1])


def mapped_points(path: Path, origin_ns: int, flight: tuple[float, float]) -> np.ndarray:
    """Sampled points of a LAZ map that were measured in flight; origin: of the flight's times."""
    table = laspy.read(path)
    times = table.gps_time - adjusted_gps_origin(origin_ns)
    return sampled(table.xyz[(times >= flight[0]) & (times <= flight[1])])


def sampled(points: np.ndarray) -> np.ndarray:
    """Evenly chosen rows."""
    return np.ascontiguousarray(points[:: max(1, len(points) // MAP_SAMPLE)])


def read_scene(path: Path) -> Scene:
    """The mesh as the simulator writes it."""
    mesh = read_mesh(path)
    if mesh is None:
        msg = f"{path}: holds no triangles"
        raise InputError(msg)
    return Scene(mesh.vertices, mesh.triangles)


def best_points(
    simulated: Path, truth: Trajectory, origin_ns: int, flight: tuple[float, float]
) -> np.ndarray:
    """Sampled points, measured in flight, of the map made with true poses, mounts and latency."""
    true = yaml.safe_load((simulated / "truth_calibration.yaml").read_text())
    payload = Payload.load(simulated / "payload.yaml")
    with Recording(next(simulated.glob("recording*")), payload) as recording:
        # The truth's clock begins at its first pose, the recording's at its first message.
        late = 1e-9 * (recording.clock.start_ns - origin_ns)
        stream = preprocess(recording.batches(), payload, Counter())
        lidar = [b for b in stream if isinstance(b, LidarBatch)]
    points = np.concatenate([b.points for b in lidar])
    times = np.concatenate([b.times for b in lidar]) + late - true["latency"]
    flown = (times >= flight[0]) & (times <= flight[1])
    step = max(1, np.count_nonzero(flown) // MAP_SAMPLE)
    chosen = np.flatnonzero(flown)[::step]
    if "encoder" in true:
        # Read at the stamps of the lidar; the motor was there at the true times.
        read = np.unwrap(np.concatenate([b.angles for b in lidar]))
        angles = np.interp(times[chosen], times + true["latency"], read) + true["encoder"]["zero"]
        in_motor = moved_by(true["encoder"]["T_motor_lidar"], points[chosen])
        turns = geometry.exp(angles[:, None] * np.array(payload.encoder.axis))
        in_imu = moved_by(true["encoder"]["T_imu_motor"], geometry.rotate(turns, in_motor))
    else:
        in_imu = moved_by(true["T_imu_lidar"], points[chosen])
    positions, quats = truth.interpolate(times[chosen])
    return geometry.compose(positions, quats, in_imu)


def moved_by(T: dict[str, list[float]], points: np.ndarray) -> np.ndarray:
    """The points in the frame that `T` leads to."""
    return geometry.compose(np.array(T["translation"]), np.array(T["quaternion"]), points)


def calibration_errors(found: dict, true: dict) -> dict[str, np.ndarray]:
    """Found minus true, by the names and in the units of the standard deviations in run.json."""
    biases = true["imu_biases"]["end"]
    errors = {
        "latency": np.array([found["latency"] - true["latency"]]),
        "gyro_bias": np.subtract(found["gyro_bias"], biases["gyro"]),
        "accel_bias": np.subtract(found["accel_bias"], biases["accel"]),
    }
    if "T_imu_lidar" in true:
        mount, described = found["mount"]["T_imu_lidar"], true["T_imu_lidar"]
        back = geometry.inverse(np.array(described["quaternion"]))
        turn = geometry.multiply(np.array(mount["quaternion"]), back)
        errors["extrinsic_rotation"] = geometry.log(turn)
        errors["extrinsic_translation"] = np.subtract(
            mount["translation"], described["translation"]
        )
    return errors


def _norm(error: np.ndarray | None) -> float | None:
    return None if error is None else float(np.linalg.norm(error))
