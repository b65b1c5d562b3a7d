# SPDX-License-Identifier: MIT OR Apache-2.0
"""One window of lidar points and a prior trajectory in, the corrected trajectory out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.base.calibration import Calibration
from bentwing.base.trajectory import Trajectory
from bentwing.odometry.continuous.core_settings import CoreSettings
from bentwing.odometry.continuous.settings import ContinuousSettings
from bentwing.odometry.continuous.slow_states import SlowStatePrior, named_std
from bentwing.odometry.core_states import core_globals, core_samples, refined_mount
from bentwing.recording import Payload
from bentwing.recording.described import described_calibration

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.recording import ImuBatch


@dataclass(frozen=True, slots=True)
class WindowResult:
    """What a window has told.

    Attributes
    ----------
    trajectory : the prior's poses, corrected
    calibration : the slow states with their standard deviations; gravity as in the prior's map
    n_surfels : pieces of surface found in the points
    n_matches, n_fixed_matches : pairs of them within the window, and with the fixed views
    inlier_share : share of the matches that agree within two standard deviations
    residual_rms : of the matches, in units of the expected noise
    translation_eigenvalues, rotation_eigenvalues : (3,) how well the matches see translation and
        rotation, increasing; 1/3 each is even, near zero is not seen
    iterations : how often the surfaces were matched anew
    converged : whether the last correction was below the thresholds
    """

    trajectory: Trajectory
    calibration: Calibration
    n_surfels: int
    n_matches: int
    n_fixed_matches: int
    inlier_share: float
    residual_rms: float
    translation_eigenvalues: NDArray[np.float64]
    rotation_eigenvalues: NDArray[np.float64]
    iterations: int
    converged: bool
    _surfels: _core.Surfels = field(repr=False)
    _registration: _core.Registration = field(repr=False)

    def fixed_view(self, start: float | None = None, stop: float | None = None) -> _core.FixedView:
        """Freeze the surfels of `[start, stop)`, s, in the map, for later windows to match with."""
        start = float(self.trajectory.times[0]) if start is None else start
        stop = float(self.trajectory.times[-1]) if stop is None else stop
        result = self._registration
        return _core.FixedView([self._surfels], start, stop, result.samples, result.globals)


def register_window(
    points: NDArray[np.float64],
    times: NDArray[np.float64],
    prior: Trajectory,
    *,
    angles: NDArray[np.float64] | None = None,
    imu: ImuBatch | None = None,
    fixed_views: Sequence[_core.FixedView] = (),
    payload: Payload | None = None,
    calibration: Calibration | None = None,
    continues: bool = False,
    settings: ContinuousSettings | None = None,
    threads: int | None = None,
) -> WindowResult:
    """Correct a trajectory by what the lidar has seen along it (Kaul 2015, section 2.1).

    Parameters
    ----------
    points : (N, 3) float64, m, lidar frame
    times : (N,) float64, s, lidar clock, non-decreasing
    prior : poses of the IMU in the map at a uniform rate, over all `times`; without an IMU, poses
        of the lidar or of the motor that turns it
    angles : (N,) float64, rad, encoder angle at each point, for a motor-turned lidar
    imu : inertial samples over the prior; also makes latency, extrinsics and biases known
    fixed_views : surfaces of earlier windows, see `WindowResult.fixed_view`
    payload : the sensor head; default: a generic lidar in the IMU's frame
    calibration : to start from; default: as the payload says, without biases
    continues : whether the window's first tenths of a second are final, as when it slides on;
        otherwise only its first pose is
    settings : surfels, registration, and which slow states are frozen
    threads : default: all cores

    Raises
    ------
    ValueError
        If an argument has the wrong shape, order or rate; the sentence names it.
    SingularSystemError, DivergedError
        If the points cannot determine the correction.
    """
    payload, settings = payload or Payload.default(), settings or ContinuousSettings()
    start = calibration or described_calibration(payload)
    samples, slow, n_threads = core_samples(prior), core_globals(start), threads or 0
    if not (len(times) and prior.covers(times[[0, -1]] - start.latency).all()):
        msg = "times: expected at least one, and all within the prior trajectory"
        raise ValueError(msg)
    surfels = _core.extract_surfels(
        points,
        times,
        angles,
        samples,
        slow,
        settings=settings.surfels,
        range_sigma=payload.lidar.range_sigma,
        threads=n_threads,
    )
    known = SlowStatePrior(
        None if imu is None else payload.imu,
        has_motor=payload.encoder is not None,
        moving=True,
        frozen=settings.frozen,
    )
    result = _core.register_window(
        samples,
        [surfels],
        fixed_views,
        None if imu is None else _core.Imu(imu.times, imu.gyro, imu.accel),
        slow,
        information=known.information,
        offset=known.offset,
        frozen=known.frozen.tolist(),
        joined=continues,
        settings=CoreSettings.of(settings.registration, payload, _interval(prior)),
        threads=n_threads,
    )
    return WindowResult(
        trajectory=Trajectory(prior.times, result.samples.positions, result.samples.quats_xyzw),
        calibration=Calibration(
            latency=result.globals.latency,
            mount=refined_mount(start.mount, result.globals),
            gyro_bias=result.globals.gyro_bias,
            accel_bias=result.globals.accel_bias,
            gravity=result.globals.gravity,
            std=named_std(known.discounted(result.covariance), known.frozen),
        ),
        n_surfels=result.n_surfels,
        n_matches=result.n_matches,
        n_fixed_matches=result.n_fixed_matches,
        inlier_share=result.inlier_share,
        residual_rms=result.residual_rms,
        translation_eigenvalues=np.array(result.translation_eigenvalues),
        rotation_eigenvalues=np.array(result.rotation_eigenvalues),
        iterations=result.n_outer,
        converged=result.converged,
        _surfels=surfels,
        _registration=result,
    )


def _interval(prior: Trajectory) -> float:
    return float((prior.times[-1] - prior.times[0]) / (len(prior.times) - 1))
