# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is known of a recording that was simulated: poses, calibration, surfaces and the best map."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import yaml

from bentwing._core import Scene
from bentwing.base.calibration import STANDARD_GRAVITY, Calibration
from bentwing.base.errors import InputError
from bentwing.base.mount import mount_from_json
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.evaluate.map import SurfaceError, surface_error
from bentwing.evaluate.simulated.measured import measured_points
from bentwing.map.project import placed_points
from bentwing.map.read_mesh import read_mesh
from bentwing.recording import LidarBatch, Payload, Recording
from bentwing.recording.preprocess import preprocess

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

MOVED = 0.1  # m from the first place: in flight
MAP_SAMPLE = 100_000  # points whose distances are measured


class Truth:
    """The truth of the recording in a folder that `simulate` has written.

    Attributes
    ----------
    folder : of the recording
    trajectory : poses of the IMU; times in s since `origin_ns`, the first pose
    flight : s, first and last time in flight
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.trajectory, self.origin_ns = read_tum(folder / "truth_trajectory.txt")
        self.flight = in_flight(self.trajectory)

    @cached_property
    def calibration(self) -> Calibration:
        """Latency, mounts, and the biases at the end."""
        return true_calibration(self.folder)

    @cached_property
    def imu_response(self) -> dict[str, Any] | None:
        """How the IMU answers, if not perfectly."""
        path = self.folder / "truth_realism.yaml"
        if not path.exists():
            return None
        drawn = yaml.safe_load(path.read_text(encoding="utf-8"))
        response: dict[str, Any] | None = drawn.get("imu", {}).get("response")
        return response

    @cached_property
    def scene(self) -> Scene:
        """The surfaces."""
        path = self.folder / "truth_scene.ply"
        mesh = read_mesh(path)
        if mesh is None:
            msg = f"{path}: holds no triangles"
            raise InputError(msg)
        return Scene(mesh.vertices, mesh.triangles)

    @cached_property
    def returns(self) -> LidarBatch:
        """Evenly chosen returns measured in flight; stamps as recorded, in s since `origin_ns`."""
        payload = Payload.load(self.folder / "payload.yaml")
        with Recording(next(self.folder.glob("recording*")), payload) as recording:
            # The truth's clock begins at its first pose, the recording's at its first message.
            late = 1e-9 * (recording.clock.start_ns - self.origin_ns)
            stream = preprocess(recording.batches(), payload, Counter())
            lidar = LidarBatch.joined([b for b in stream if isinstance(b, LidarBatch)])
        lidar = replace(lidar, times=lidar.times + late)
        times, (first, last) = lidar.times - self.calibration.latency, self.flight
        flown = np.flatnonzero((times >= first) & (times <= last))
        return lidar.where(flown[:: max(1, len(flown) // MAP_SAMPLE)])

    @cached_property
    def best_points(self) -> Array:
        """Some points (N, 3), m, of the map that true poses, mounts and latency make in flight.

        A simulation whose stamps and mounts are as real ones are leaves them; a reader of its
        recording cannot know when late messages were truly measured.
        """
        if (self.folder / "truth_points.npy").exists():
            rows = np.load(self.folder / "truth_points.npy")
            first, last = self.flight
            return np.ascontiguousarray(rows[(rows[:, 3] >= first) & (rows[:, 3] <= last), :3])
        lidar, angles = self.returns, self.returns.angles
        if angles is not None:
            # Read at the stamps of the lidar; the motor was there at the true times.
            read = np.unwrap(angles)
            true_times = lidar.times - self.calibration.latency
            lidar = replace(lidar, angles=np.interp(true_times, lidar.times, read))
        return placed_points([lidar], self.trajectory, self.calibration)

    def distances(self, points: Array) -> Array:
        """Distances (N,) of points (N, 3) in the world from the true surfaces, m, signed."""
        distances: Array = self.scene.distance(np.ascontiguousarray(points))[0]
        return distances

    def map_error(self, points: Array) -> SurfaceError:
        """Compare points (N, 3) in the world with the true surfaces and with the best map."""
        return surface_error(self.distances(points), best=self.distances(self.best_points))


def in_flight(truth: Trajectory) -> tuple[float, float]:
    """From the first to the last time away from the first place, s.

    Raises
    ------
    InputError
        If the truth does not move.
    """
    away = np.linalg.norm(truth.positions - truth.positions[0], axis=1) > MOVED
    if not away.any():
        msg = "the truth does not move"
        raise InputError(msg)
    return float(truth.times[away][0]), float(truth.times[away][-1])


def true_calibration(folder: Path, biases: Literal["start", "end"] = "end") -> Calibration:
    """Return latency, mounts and biases as the simulated head in a folder truly has them.

    Parameters
    ----------
    biases : of the IMU, which wander: those at the start or at the end of the recording
    """
    true = yaml.safe_load((folder / "truth_calibration.yaml").read_text(encoding="utf-8"))
    bias = true["imu_biases"][biases]
    gravity = np.array([0.0, 0.0, STANDARD_GRAVITY])
    return Calibration(
        true["latency"],
        mount_from_json(true),
        np.array(bias["gyro"]),
        np.array(bias["accel"]),
        gravity,
    )


def mapped_points(path: Path, origin_ns: int, flight: tuple[float, float]) -> Array:
    """Read some points (N, 3), m, of the LAZ map of a run that were measured in flight, as measured.

    Parameters
    ----------
    origin_ns : epoch of the times of `flight`
    flight : s, first and last time
    """
    points, times = measured_points(path, origin_ns)
    return sampled(points[(times >= flight[0]) & (times <= flight[1])])


def sampled(points: Array) -> Array:
    """Evenly chosen rows, about `MAP_SAMPLE`."""
    return np.ascontiguousarray(points[:: max(1, len(points) // MAP_SAMPLE)])
