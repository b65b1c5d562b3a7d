# SPDX-License-Identifier: MIT OR Apache-2.0
"""How accurate a result is expected to be, without a reference: from what the estimate says of itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from bentwing.base.covariances import PoseCovariances
    from bentwing.base.trajectory import Trajectory

# Within this many standard deviations lie 68 % of the errors in a plane.
_IN_A_PLANE = 1.51
_SHORT = 10.0  # m, of the second statement


@dataclass(frozen=True, slots=True)
class ExpectedAccuracy:
    """What 68 % of the errors are below, relative to the first pose.

    Attributes
    ----------
    horizontal, vertical : m, of the least certain pose
    heading : rad, of the least certain pose
    horizontal_per_10m, vertical_per_10m, heading_per_10m : over ten metres of the path, with an error
        that adds up as a random walk
    map_thickness : m, standard deviation of points across their surface: noise of the ranges, and of
        the poses over ten metres
    """

    horizontal: float
    vertical: float
    heading: float
    horizontal_per_10m: float
    vertical_per_10m: float
    heading_per_10m: float
    map_thickness: float

    def sentence(self) -> str:
        """Say it in a sentence."""
        whole = _named(self.horizontal, self.vertical, self.heading)
        short = _named(self.horizontal_per_10m, self.vertical_per_10m, self.heading_per_10m)
        return (
            f"Expected accuracy (68 %): over the whole path {whole}; over ten metres of it {short}; "
            f"surfaces in the map scatter by {1e3 * self.map_thickness:.0f} mm."
        )


def expected_accuracy(
    trajectory: Trajectory, covariances: PoseCovariances | None, range_sigma: float
) -> ExpectedAccuracy | None:
    """Return what to expect of a trajectory and the map it makes; None without covariances.

    Parameters
    ----------
    range_sigma : m, noise of the lidar's ranges
    """
    if covariances is None or not len(covariances.times):
        return None
    variances = np.einsum("kii->ki", covariances.matrices).max(axis=0)
    horizontal = _IN_A_PLANE * float(np.sqrt(variances[3:5].mean()))
    vertical, heading = float(np.sqrt(variances[5])), float(np.sqrt(variances[2]))
    times = covariances.times
    positions, _ = trajectory.interpolate(times[trajectory.covers(times)])
    path = float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum())
    share = float(np.sqrt(_SHORT / max(_SHORT, path)))
    of_poses = share * float(np.sqrt(variances[3:].mean()))
    return ExpectedAccuracy(
        horizontal,
        vertical,
        heading,
        share * horizontal,
        share * vertical,
        share * heading,
        float(np.hypot(range_sigma, of_poses)),
    )


def _named(horizontal: float, vertical: float, heading: float) -> str:
    return (
        f"{_length(horizontal)} horizontally, {_length(vertical)} vertically and "
        f"{np.degrees(heading):.2g}° in heading"
    )


def _length(metres: float) -> str:
    if metres < 0.1:
        return f"{1e3 * metres:.2g} mm" if metres < 0.01 else f"{1e3 * metres:.0f} mm"
    return f"{metres:.2f} m"
