# SPDX-License-Identifier: MIT OR Apache-2.0
"""One run of the filter over consecutive sweeps."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.base import geometry
from bentwing.base.mount import MotorMount, Pose
from bentwing.base.window_record import WindowRecord
from bentwing.odometry.health import is_degenerate
from bentwing.odometry.kalman.core import SLOW, anchored, unlearned_delay
from bentwing.odometry.kalman.learned import calibration_of
from bentwing.odometry.kalman.snapshot import N_RECENT, FilterSnapshot, joined_poses
from bentwing.odometry.segments import extrapolated, heading
from bentwing.odometry.start import levelling

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.odometry.buffer import LidarStretch
    from bentwing.odometry.kalman.beginning import Beginning
    from bentwing.odometry.kalman.core import FilterSettings, Transform
    from bentwing.recording.batches import ImuBatch

    Poses = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]

# Fewer points are no sweep.
MIN_POINTS = 100
# How much less certain a second beginning is of what the first has learned from the same data.
DOUBT = 2.0
# Of a carrier at rest, m/s.
REST_SPEED = 3e-3


class FilterPass:
    """The filter with the poses and records it has left behind.

    Parameters
    ----------
    beginning : what it begins with
    """

    def __init__(self, settings: FilterSettings, beginning: Beginning) -> None:
        self._beginning = beginning
        state = beginning.state
        # Samples that are those of the rest at the start, as long as there are.
        self._rest = beginning.rest
        self.filter = _core.KalmanFilter(
            settings,
            time=beginning.time,
            state=state,
            covariance=np.ascontiguousarray(anchored(beginning.covariance, state)),
        )
        self.start, self.described = beginning.time, beginning.described
        self.latency, self.mount = beginning.described.latency, beginning.described.mount
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

    def snapshot(self, *, is_settling: bool = False) -> FilterSnapshot:
        """Return what has been found so far, to be read while the filter goes on."""
        return FilterSnapshot(
            self.end + self.latency,
            np.array(self.filter.gravity),
            calibration_of(self.filter, self.motor_rate, self.described),
            [*self.windows],
            [*self._poses],
            self._covariances[::N_RECENT],
            self.blind,
            self.seconds,
            is_settling,
        )

    def anchor(self) -> Pose:
        """Return where the motor, or the fixed lidar, is as the map begins, level."""
        at, quat = _composed(self._beginning.state.pose, self._beginning.state.base)
        turn = levelling(np.array(self.filter.gravity))
        return Pose(geometry.rotate(turn, at), geometry.multiply(turn, quat))

    def again(self) -> Beginning:
        """Return the beginning with what this pass, a rehearsal, has learned."""
        learned = self._learned(self._beginning, DOUBT)
        if isinstance(self.mount, MotorMount):
            delay = unlearned_delay(self.motor_rate, self.mount, learned.state)
            learned = replace(learned, covariance=learned.covariance + delay)
        return learned

    def continued(self, beginning: Beginning) -> Beginning:
        """Return a beginning behind a break: what was learned, in the direction of the last motion."""
        at, quat = extrapolated(self.trajectory(), beginning.time)
        level = np.array(beginning.state.pose[1])
        turn = heading(geometry.multiply(quat, geometry.inverse(level)))
        placed = at.tolist(), geometry.multiply(turn, level).tolist()
        learned = self._learned(beginning, 1.0)
        return replace(learned, state=replace(learned.state, pose=placed))

    def _learned(self, beginning: Beginning, growth: float) -> Beginning:
        """Return a beginning with the slow states of now, `growth` times as uncertain."""
        now = self.filter
        state = replace(
            beginning.state,
            gyro_bias=now.gyro_bias,
            accel_bias=now.accel_bias,
            gravity=now.gravity,
            base=now.base,
            lidar=now.lidar,
            latency=now.latency,
            encoder_delay=now.encoder_delay,
        )
        covariance = beginning.covariance.copy()
        covariance[SLOW, :] = covariance[:, SLOW] = 0.0
        block = np.ix_(SLOW, SLOW)
        covariance[block] = growth**2 * now.covariance[block]
        return replace(beginning, state=state, covariance=covariance)

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
        degenerate=not matched or is_degenerate(shift, turn),
        translation_eigenvalues=list(shift),
        rotation_eigenvalues=list(turn),
    )


def _composed(pose: Transform, inner: Transform) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    (translation, quat), (shift, turn) = ([np.array(part) for part in p] for p in (pose, inner))
    return geometry.compose(translation, quat, shift), geometry.multiply(quat, turn)
