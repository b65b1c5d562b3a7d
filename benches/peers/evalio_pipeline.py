# SPDX-License-Identifier: MIT OR Apache-2.0
"""bentwing as a pipeline of evalio: `EVALIO_CUSTOM=benches.peers.evalio_pipeline evalio run -p bentwing …`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from evalio.pipelines import Pipeline
from evalio.types import SE3, SO3, Stamp

from bentwing import odometry
from bentwing.base import geometry
from bentwing.base.errors import NotEnoughDataError
from bentwing.base.provenance import bentwing_version
from bentwing.odometry.continuous.settings import ContinuousSettings
from bentwing.recording import ImuBatch, LidarBatch, Payload

if TYPE_CHECKING:
    from evalio.types import ImuMeasurement, ImuParams, LidarMeasurement, LidarParams

    from bentwing.base.trajectory import Trajectory

Pose = tuple[np.ndarray, np.ndarray]


class Bentwing(Pipeline):
    """The continuous-time estimator; a pose per scan, at its start, once no window changes it.

    evalio does not say when a sequence ends, so of the last seconds, which are still in the
    window, there are poses only for who calls `finish`.
    """

    def __init__(self) -> None:
        super().__init__()
        self._threads = 1
        self._described: dict[str, dict] = {"lidar": {}, "imu": {}, "T_imu_lidar": {}}
        self._settings = ContinuousSettings()
        self._estimator: odometry.Estimator | None = None
        self._origin_ns: int | None = None
        self._last = -np.inf
        self._asked = -np.inf
        self._waiting: list[tuple[float, Stamp]] = []
        self._given: tuple[float, Pose] | None = None

    @staticmethod
    def name() -> str:
        """As on the command line."""
        return "bentwing"

    @staticmethod
    def url() -> str:
        """The project has no address yet that would not be misleading."""
        return "-"

    @staticmethod
    def version() -> str:
        """Version of the package."""
        return bentwing_version()

    @staticmethod
    def default_params() -> dict[str, bool | int | float | str]:
        """One thread, as engines are compared."""
        return {"threads": 1}

    def set_params(self, params) -> dict[str, bool | int | float | str]:
        """Take what is known and return the rest."""
        self._threads = int(params.get("threads", self._threads))
        return {name: value for name, value in params.items() if name != "threads"}

    def set_imu_params(self, params: ImuParams) -> None:
        """Noise of the IMU."""
        self._described["imu"] = {
            "gyro_noise": params.gyro,
            "accel_noise": params.accel,
            "gyro_bias_walk": params.gyro_bias,
            "accel_bias_walk": params.accel_bias,
        }

    def set_lidar_params(self, params: LidarParams) -> None:
        """Ranges of the lidar."""
        limits = {"min_range": params.min_range, "max_range": params.max_range}
        self._described["lidar"] = limits

    def set_imu_T_lidar(self, T: SE3) -> None:
        """Nominal mount; it is estimated along."""
        quat = [T.rot.qx, T.rot.qy, T.rot.qz, T.rot.qw]
        self._described["T_imu_lidar"] = {"translation": T.trans.tolist(), "quaternion": quat}

    def set_visualizing(self, visualize) -> None:
        """Nothing to show while it runs."""

    def map(self) -> dict:
        """The map is made after the trajectory."""
        return {}

    def initialize(self) -> None:
        """Make the estimator."""
        payload = Payload.model_validate(self._described)
        self._estimator = odometry.create("continuous", payload, self._settings, self._threads)

    def add_imu(self, mm: ImuMeasurement) -> None:
        """Take a sample."""
        time = np.array([self._since_origin(mm.stamp)])
        self._estimator.feed(ImuBatch(time, mm.gyro[None].copy(), mm.accel[None].copy()))

    def add_lidar(self, mm: LidarMeasurement) -> None:
        """Take a scan, and give the poses that have become final."""
        start = self._since_origin(mm.stamp)
        points = np.array(mm.to_vec_positions()).reshape(-1, 3)
        times = start + np.array(mm.to_vec_stamps())
        ranges, limits = np.linalg.norm(points, axis=1), self._described["lidar"]
        kept = np.flatnonzero((ranges >= limits["min_range"]) & (ranges <= limits["max_range"]))
        kept = kept[ranges[kept] > 0]
        kept = kept[np.argsort(times[kept], kind="stable")]
        if not len(kept):
            return
        # Scans of some datasets overlap by the jitter of their stamps.
        batch = LidarBatch(points[kept], np.maximum(times[kept], self._last))
        self._last = float(batch.times[-1])
        self._waiting.append((start, mm.stamp))
        self._estimator.feed(batch)
        if start - self._asked >= self._settings.shift:
            self._asked = start
            self._give_final()

    def finish(self) -> None:
        """Give the poses of the last seconds."""
        self._give(self._estimator.result().trajectory, np.inf)

    def _since_origin(self, stamp: Stamp) -> float:
        if self._origin_ns is None:
            self._origin_ns = stamp.to_nsec()
        return 1e-9 * (stamp.to_nsec() - self._origin_ns)

    def _give_final(self) -> None:
        try:
            estimate = self._estimator.so_far()
        except NotEnoughDataError:
            return
        final = estimate.trajectory.times[-1] - self._settings.window - self._settings.shift
        self._give(estimate.trajectory, final)

    def _give(self, trajectory: Trajectory, until: float) -> None:
        end = min(until, float(trajectory.times[-1]))
        ready = [(t, stamp) for t, stamp in self._waiting if t <= end]
        self._waiting = self._waiting[len(ready) :]
        for time, stamp in ready:
            if time >= trajectory.times[0]:
                p, q = self._continued(trajectory, time)
                self.save(stamp, SE3(SO3(qx=q[0], qy=q[1], qz=q[2], qw=q[3]), p))

    def _continued(self, trajectory: Trajectory, time: float) -> Pose:
        """The pose by its motion since the last one given: each estimate is levelled anew."""
        pose = _pose(trajectory, time)
        if self._given is not None:
            before, (p0, q0) = self._given
            p, q = _pose(trajectory, before)
            back = geometry.multiply(q0, geometry.inverse(q))
            pose = (p0 + geometry.rotate(back, pose[0] - p), geometry.multiply(back, pose[1]))
        self._given = time, pose
        return pose


def _pose(trajectory: Trajectory, time: float) -> Pose:
    positions, quats = trajectory.interpolate(np.array([time]))
    return positions[0], quats[0]
