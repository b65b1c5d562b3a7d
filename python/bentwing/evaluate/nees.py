# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether an estimate is as uncertain as it says: normalized estimation errors squared (NEES)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.covariances import PoseCovariances
    from bentwing.base.trajectory import Trajectory

    Array = NDArray[np.float64]
    Pose = tuple[Array, Array]

_QUANTILE = 1.959963984540054
"""Of the normal distribution at 97.5 %."""


def pose_errors_since(
    reference: float, estimate: Trajectory, truth: Trajectory, times: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Errors of an estimate that agrees with the truth at a time of reference, but for the tilt.

    An odometry chooses position and heading of its frame, and measures what is up. The estimate's own
    error at the reference is in all of the errors then; see `pose_errors_from`, where it is not.

    Parameters
    ----------
    reference : s, at which positions and headings agree
    times : (K,) s, within both

    Returns
    -------
    (K, 6) rotation, rad, and translation, m: `R_estimate = Exp(e) R_true`, map frame
    """
    at, quat = truth.interpolate(np.array([reference]))
    there, estimated = estimate.interpolate(np.array([reference]))
    return pose_errors_from((there[0], estimated[0]), (at[0], quat[0]), estimate, truth, times)


def pose_errors_from(
    anchor: Pose, true_anchor: Pose, estimate: Trajectory, truth: Trajectory, times: Array
) -> Array:
    """Errors of an estimate whose frame is that of something whose pose it takes as exact.

    Parameters
    ----------
    anchor : position (3,), m, and quaternion (4,) in the frame of the estimate, of what its frame hangs
        on: the lidar, or its motor, as the map begins
    true_anchor : the same in the frame of the truth; of the rotation the heading counts
    times : (K,) s, within both

    Returns
    -------
    (K, 6) rotation, rad, and translation, m: `R_estimate = Exp(e) R_true`, map frame
    """
    (there, estimated), (at, quat) = anchor, true_anchor
    turn = geometry.multiply(estimated, geometry.inverse(quat))
    heading = np.array([[0.0, 0.0, turn[2], turn[3]]])
    heading /= np.linalg.norm(heading)
    positions, quats = truth.interpolate(times)
    positions = geometry.rotate(heading, positions - at) + there
    quats = geometry.multiply(heading, quats)
    found, found_quats = estimate.interpolate(times)
    turned = geometry.log(geometry.multiply(found_quats, geometry.inverse(quats)))
    return np.hstack([turned, found - positions])


def normalized_pose_errors(
    estimate: Trajectory,
    covariances: PoseCovariances,
    truth: Trajectory,
    span: tuple[float, float],
) -> Array:
    """Return errors (K, 6) of poses in units of their standard deviations, two a second.

    Estimate and truth agree in position and heading of the first pose, as the covariances mean it.

    Parameters
    ----------
    span : s, within both, of the poses that count
    """
    first = max(float(estimate.times[0]), float(truth.times[0]))
    last = min(span[1], float(estimate.times[-1]), float(truth.times[-1]))
    times = np.arange(max(span[0], first), last, 0.5)
    errors = pose_errors_since(first, estimate, truth, times)
    variances = np.einsum("kii->ki", covariances.at(times))
    return np.asarray(errors / np.sqrt(variances))


def nees(errors: NDArray[np.float64], covariances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `eᵀ P⁻¹ e` (K,) of errors (K, D) and covariances (K, D, D)."""
    solved = np.linalg.solve(covariances, errors[:, :, None])[:, :, 0]
    return np.asarray(np.einsum("kd,kd->k", errors, solved))


def nees_bounds(n_runs: int, dimension: int) -> tuple[float, float]:
    """Return the bounds within which the mean over independent runs lies with 95 %.

    The sum is χ² with `n_runs · dimension` degrees of freedom; its quantiles by Wilson and Hilferty.
    """
    n = float(n_runs * dimension)
    low, high = (
        n * (1 - 2 / (9 * n) + z * np.sqrt(2 / (9 * n))) ** 3 for z in (-_QUANTILE, _QUANTILE)
    )
    return float(low / n_runs), float(high / n_runs)
