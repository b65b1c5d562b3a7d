# SPDX-License-Identifier: MIT OR Apache-2.0
"""One run of the filter over consecutive sweeps."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.base import geometry
from bentwing.base.window_record import WindowRecord
from bentwing.odometry.kalman.core import SLOW, FilterState
from bentwing.odometry.kalman.learned import calibration_of
from bentwing.odometry.kalman.snapshot import FilterSnapshot, joined_poses

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.mount import Mount
    from bentwing.base.trajectory import Trajectory
    from bentwing.odometry.buffer import LidarStretch
    from bentwing.odometry.kalman.core import FilterSettings, Transform
    from bentwing.recording.batches import ImuBatch

    Poses = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]

# A sweep is degenerate when it says so much less, as a share of all, about its translation or its
# rotation in one direction.
LEAST_SHARE = 5e-4
# Fewer points are no sweep.
MIN_POINTS = 100
# The mean over a sweep differs from that of the rest by less, rad/s and m/s².
MAX_REST_RATE, MAX_REST_FORCE = 0.01, 0.15
# Of a carrier at rest, m/s.
REST_SPEED = 3e-3


@dataclass(frozen=True, slots=True)
class Rest:
    """Mean rate (3,), rad/s, and specific force (3,), m/s², of an IMU at rest."""

    rate: NDArray[np.float64]
    force: NDArray[np.float64]

    def lasts(self, imu: ImuBatch) -> bool:
        """Tell whether samples around a sweep are those of the same rest."""
        if not len(imu.times):
            return False
        turned = np.linalg.norm(imu.gyro.mean(axis=0) - self.rate)
        pushed = np.linalg.norm(imu.accel.mean(axis=0) - self.force)
        return bool(turned < MAX_REST_RATE and pushed < MAX_REST_FORCE)


class FilterPass:
    """The filter with the poses and records it has left behind.

    Parameters
    ----------
    time, state, covariance : at the start
    rest : what the IMU says at rest, if that is how it begins
    """

    def __init__(
        self,
        settings: FilterSettings,
        time: float,
        state: FilterState,
        covariance: NDArray[np.float64],
        rest: Rest | None = None,
    ) -> None:
        self._rest = rest
        self.filter = _core.KalmanFilter(
            settings, time=time, state=state, covariance=np.ascontiguousarray(covariance)
        )
        self.start = time
        # Of the motor, or the fixed lidar, as the map begins: what the frame hangs on.
        self.anchor = _composed(state.pose, state.base)
        self.windows: list[WindowRecord] = []
        self.blind = 0.0
        self.seconds = 0.0
        # rad/s, of the motor, where it turned last.
        self.motor_rate = 0.0
        self._poses: list[Poses] = []
        self._odometry: tuple[list[Poses], list[Poses]] = ([], [])
        self._covariances: list[tuple[float, NDArray[np.float64]]] = []

    @property
    def end(self) -> float:
        """Time of the state, s."""
        return float(self.filter.time)

    def take(self, imu: ImuBatch, sweep: LidarStretch, stop: float) -> None:
        """Carry the state on to `stop`, and correct it by a sweep that ends there.

        From a start at rest on the velocity is zero as long as the inertial samples are those of rest.
        """
        began = time.perf_counter()
        self.filter.propagate(imu.times, imu.gyro, imu.accel, until=stop)
        if len(sweep.times) < MIN_POINTS:
            self.filter.release()
        else:
            found = self.filter.update(
                sweep.points, sweep.times, rings=sweep.rings, angles=sweep.angles
            )
            self.blind += found.blind
            self.windows.append(record_of(stop, len(sweep.times), found))
            self._covariances.append((stop, self.filter.pose_covariance))
            self._watch_motor(sweep)
        if self._rest is not None and not (self._rest.lasts(imu) and self.filter.rest(REST_SPEED)):
            self._rest = None
        self._poses.append(self.filter.take_poses())
        for kept, new in zip(self._odometry, self.filter.take_odometry(), strict=True):
            kept.append(new)
        self.seconds += time.perf_counter() - began

    def trajectory(self) -> Trajectory:
        """Return the corrected poses, 100 a second."""
        return joined_poses(self._poses)

    def odometry(self) -> tuple[Trajectory, Trajectory]:
        """Return the poses as they were known at their times, raw and smoothed."""
        raw, smoothed = self._odometry
        return joined_poses(raw), joined_poses(smoothed)

    def pose_covariances(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return times (K,) and covariances (K, 6, 6) of attitude and position after the sweeps."""
        times = np.array([t for t, _ in self._covariances])
        covariances = np.array([c for _, c in self._covariances]).reshape(-1, 6, 6)
        return times, covariances

    def snapshot(self, mount: Mount, *, is_settling: bool) -> FilterSnapshot:
        """Return what has been found so far, to be read while the filter goes on."""
        return FilterSnapshot(
            self.start,
            self.end,
            np.array(self.filter.gravity),
            calibration_of(self.filter, self.motor_rate, mount),
            [*self.windows],
            [*self._poses],
            self.blind,
            self.seconds,
            is_settling,
        )

    def slow_state(self, start: FilterState) -> FilterState:
        """Return `start` with the biases, gravity, mounts and delays of now."""
        now = self.filter
        return FilterState(
            start.pose,
            start.velocity,
            now.gyro_bias,
            now.accel_bias,
            now.gravity,
            now.base,
            now.lidar,
            now.latency,
            now.encoder_delay,
        )

    def slow_covariance(self, start: NDArray[np.float64], growth: float) -> NDArray[np.float64]:
        """Return `start` (31, 31) with what is known of the slow states now, `growth` times as uncertain."""
        covariance = start.copy()
        covariance[SLOW, :] = covariance[:, SLOW] = 0.0
        block = np.ix_(SLOW, SLOW)
        covariance[block] = growth**2 * self.filter.covariance[block]
        return covariance

    def _watch_motor(self, sweep: LidarStretch) -> None:
        if sweep.angles is not None and sweep.times[-1] > sweep.times[0]:
            turned = float(sweep.angles[-1] - sweep.angles[0])
            self.motor_rate = turned / float(sweep.times[-1] - sweep.times[0])


def record_of(stop: float, n_points: int, found: _core.KalmanSweep) -> WindowRecord:
    """Return the record of a sweep, as `Estimate.windows` holds it."""
    shift, turn = found.eigenvalues
    matches, lines = found.n_matches
    planar, edges = found.n_features
    matched = found.matched
    return WindowRecord(
        time=stop,
        n_surfels=found.n_planes,
        n_points=n_points,
        n_planar=planar,
        n_edges=edges,
        n_matches=matches,
        n_line_matches=lines,
        registered=matched,
        new_share=found.new_share,
        inlier_share=found.inlier_share if matched else None,
        residual_rms=found.residual_rms if matched else None,
        registration_rmse=found.rmse if matched else None,
        iterations=found.n_iterations,
        converged=found.converged,
        degenerate=not matched or min(shift[0], turn[0]) < LEAST_SHARE,
        translation_eigenvalues=list(shift),
        rotation_eigenvalues=list(turn),
    )


def _composed(pose: Transform, inner: Transform) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    (translation, quat), (shift, turn) = ([np.array(part) for part in p] for p in (pose, inner))
    return geometry.compose(translation, quat, shift), geometry.multiply(quat, turn)
