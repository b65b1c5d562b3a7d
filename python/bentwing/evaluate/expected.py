# SPDX-License-Identifier: MIT OR Apache-2.0
"""How accurate a result is expected to be, without a reference: from what the estimate says of itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.covariances import SHORT

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.estimate import Estimate
    from bentwing.evaluate.revisits import Revisits

# Within this many standard deviations lie 68 % of the errors in a plane.
_IN_A_PLANE = 1.51


@dataclass(frozen=True, slots=True)
class ExpectedAccuracy:
    """What 68 % of the errors are below, relative to the first pose.

    Attributes
    ----------
    horizontal, vertical : m, of the least certain pose
    heading : rad, of the least certain pose
    horizontal_per_10m, vertical_per_10m, heading_per_10m : of a pose as seen from the one ten metres of
        path before, in the mean
    map_thickness : m, standard deviation of points across the surfaces of the map: of the ranges' noise,
        and of how far apart two visits have seen the same; without any of the poses over ten metres;
        None where there is no map
    """

    horizontal: float
    vertical: float
    heading: float
    horizontal_per_10m: float
    vertical_per_10m: float
    heading_per_10m: float
    map_thickness: float | None


def expected_accuracy(
    estimate: Estimate, range_sigma: float, revisits: Revisits | None = None
) -> ExpectedAccuracy | None:
    """Return what to expect of an estimate and the map it makes; None where it has no covariances.

    Parameters
    ----------
    range_sigma : m, noise of the lidar's ranges
    revisits : how far surfaces that were seen twice lie apart in the map, if any were
    """
    covariances = estimate.covariances
    if covariances is None or not len(covariances.times):
        return None
    whole = np.einsum("kii->ki", covariances.matrices).max(axis=0)
    short = estimate.short_variances
    if short is None:
        short = min(1.0, SHORT / max(_path(estimate), 1e-9)) * whole
    # Each of two visits has an error of its own, so that the variance of their distance is that of both.
    apart = np.sqrt(2.0 * short[3:].mean()) if revisits is None else revisits.std
    # Rays meet surfaces at all angles: across them one half of the noise's variance is left in the mean.
    thickness = float(np.sqrt(0.5 * (range_sigma**2 + apart**2)))
    return ExpectedAccuracy(*_radii(whole), *_radii(short), map_thickness=thickness)


def _radii(variances: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return what 68 % of the errors are below: horizontally, vertically, m, and in heading, rad."""
    horizontal = _IN_A_PLANE * float(np.sqrt(variances[3:5].mean()))
    return horizontal, float(np.sqrt(variances[5])), float(np.sqrt(variances[2]))


def _path(estimate: Estimate) -> float:
    """Return the length of the path between the poses that have covariances, m."""
    trajectory = estimate.trajectory
    times = estimate.covariances.times if estimate.covariances is not None else np.empty(0)
    positions, _ = trajectory.interpolate(times[trajectory.covers(times)])
    return float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum())
