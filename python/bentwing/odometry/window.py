# SPDX-License-Identifier: MIT OR Apache-2.0
"""One window of lidar points and a prior trajectory in, the corrected trajectory out."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.base.arguments import instance, thread_count
from bentwing.base.calibration import Calibration
from bentwing.base.errors import NotEnoughDataError
from bentwing.base.log import get_logger
from bentwing.base.trajectory import Trajectory
from bentwing.odometry.continuous.core_settings import CoreSettings
from bentwing.odometry.continuous.settings import ContinuousSettings
from bentwing.odometry.continuous.slow_states import SlowStatePrior, named_std
from bentwing.odometry.core_states import core_globals, refined
from bentwing.odometry.window_inputs import (
    Points,
    checked_points,
    core_views,
    inertial_samples,
    pose_interval,
    prior_samples,
)
from bentwing.odometry.window_result import WindowResult
from bentwing.recording.described import described_calibration
from bentwing.recording.payload import as_payload

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from bentwing.odometry.window_result import FixedView
    from bentwing.recording.batches import ImuBatch
    from bentwing.recording.payload import Payload, PayloadLike

_log = get_logger(__name__)


def register_window(
    points: ArrayLike,
    times: ArrayLike,
    prior: Trajectory,
    *,
    angles: ArrayLike | None = None,
    imu: ImuBatch | None = None,
    fixed_views: Sequence[FixedView] = (),
    payload: PayloadLike = None,
    calibration: Calibration | None = None,
    continues: bool = False,
    settings: ContinuousSettings | None = None,
    threads: int | None = None,
) -> WindowResult:
    """Correct a trajectory by what the lidar saw along it (Kaul 2015, section 2.1).

    Parameters
    ----------
    points : (N, 3), m, lidar frame
    times : (N,), s, lidar clock, non-decreasing; a `Recording` has taken a large latency off already
    prior : poses of the IMU in the map at a uniform rate, over all `times`; without an IMU, poses
        of the lidar or of the motor that turns it
    angles : (N,), rad, encoder angle at each point, for a motor-turned lidar
    imu : inertial samples over the prior; also makes latency, extrinsics and biases known
    fixed_views : surfaces of earlier windows, see `WindowResult.fixed_view`
    payload : the sensor head, or the payload.yaml that describes it; default: a generic lidar in the
        IMU's frame
    calibration : to start from; default: as the payload says, without biases
    continues : whether the window's first tenths of a second are final, as when it slides on;
        otherwise only its first pose is
    settings : surfels, registration, and which slow states are frozen
    threads : default: all cores

    Raises
    ------
    ValueError, TypeError
        If an argument has the wrong type, shape, order or rate; the sentence names it.
    NotEnoughDataError
        If no surface was seen twice, within the window or in the fixed views.
    SingularSystemError, DivergedError
        If the points cannot determine the correction.
    """
    head, n_threads = as_payload(payload), thread_count(threads)
    chosen = _settings(settings)
    start = _calibration(calibration, head)
    samples = prior_samples(prior, chosen.registration.knot_interval)
    seen = checked_points(points, times, angles, prior, start)
    inertial, views = inertial_samples(imu), core_views(fixed_views)
    slow = core_globals(start)
    surfels = _core.extract_surfels(
        seen.points,
        seen.times,
        seen.angles,
        samples,
        slow,
        settings=chosen.surfels,
        range_sigma=head.lidar.range_sigma,
        threads=n_threads,
    )
    known = SlowStatePrior(
        None if imu is None else head.imu,
        has_motor=head.encoder is not None,
        moving=True,
        frozen=(*chosen.frozen, "latency_rate"),  # a window alone does not show it
    )
    found = _core.register_window(
        samples,
        [surfels],
        views,
        inertial,
        slow,
        information=known.information,
        offset=known.offset,
        frozen=known.frozen.tolist(),
        joined=continues,
        settings=CoreSettings.of(chosen.registration, head, pose_interval(prior)),
        threads=n_threads,
    )
    _require_matches(found, seen)
    return _result(found, surfels, prior, start, known)


def _result(
    found: _core.Registration,
    surfels: _core.Surfels,
    prior: Trajectory,
    start: Calibration,
    known: SlowStatePrior,
) -> WindowResult:
    return WindowResult(
        trajectory=Trajectory(prior.times, found.samples.positions, found.samples.quats_xyzw),
        calibration=replace(
            refined(start, found.globals),
            gravity=found.globals.gravity,
            std=named_std(known.discounted(found.covariance), known.frozen),
        ),
        n_surfels=found.n_surfels,
        n_matches=found.n_matches,
        n_fixed_matches=found.n_fixed_matches,
        inlier_share=found.inlier_share,
        residual_rms=found.residual_rms,
        translation_eigenvalues=np.array(found.translation_eigenvalues),
        rotation_eigenvalues=np.array(found.rotation_eigenvalues),
        iterations=found.n_outer,
        converged=found.converged,
        covariances=found.sample_covariances(),
        _surfels=surfels,
        _samples=found.samples,
        _globals=found.globals,
    )


def _settings(settings: ContinuousSettings | None) -> ContinuousSettings:
    if settings is None:
        return ContinuousSettings()
    remedy = "make one: ContinuousSettings(surfels=SurfelSettings(voxel_size=0.2))"
    return instance("settings", settings, ContinuousSettings, remedy)


def _calibration(calibration: Calibration | None, payload: Payload) -> Calibration:
    if calibration is None:
        described = described_calibration(payload)
        # Nothing has been taken off the stamps: they come from the caller, not from a recording.
        return replace(described, latency=described.source_latency, latency_read=0.0)
    remedy = "give that of an earlier result, or leave it out"
    return instance("calibration", calibration, Calibration, remedy)


def _require_matches(found: _core.Registration, seen: Points) -> None:
    n_matches, n_points = found.n_matches + found.n_fixed_matches, len(seen.points)
    _log.debug(
        "window of %d points: %d surfels, %d matches, %d iterations, converged: %s",
        n_points, found.n_surfels, n_matches, found.n_outer, found.converged,
    )  # fmt: skip
    if n_matches:
        return
    msg = (
        f"points: {n_points} over {seen.span:.2f} s make {found.n_surfels} surfels, and no two of "
        "them match, nor one and a fixed view, so nothing says how to correct the prior; give "
        "points in metres with their own times, long enough for surfaces to be seen twice"
    )
    raise NotEnoughDataError(msg)
