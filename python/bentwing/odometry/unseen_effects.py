# SPDX-License-Identifier: MIT OR Apache-2.0
"""What errors of unit size that all poses share make of poses (K, 6): `[δr, δt]`, map frame.

Poses are as seen from a first one, with its position and heading, from which they are `away` (K, 3), m.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def of_frame(first: Array, last: Array, away: Array) -> Array:
    """Return effects (K, 6, 3) of a frame of the IMU that is turned about its axes.

    Parameters
    ----------
    first, last : (K, 3, 3) attitudes of the IMU
    """
    effects = of_frame_in_map(last)
    # With the first pose's heading, which is turned as well, goes the whole map.
    heading = first[:, 2]
    effects[:, 2] -= heading
    effects[:, 3] = away[:, 1:2] * heading
    effects[:, 4] = -away[:, :1] * heading
    return effects


def of_frame_in_map(last: Array) -> Array:
    """Return the same of poses in a given map."""
    effects = np.zeros((len(last), 6, 3))
    effects[:, :3] = last
    return effects


def of_force(mean: Array, away: Array) -> Array:
    """Return effects (K, 6, 3) of a direction of gravity that is wrong in the frame of the IMU.

    A head that turns averages what its accelerometer errs by.

    Parameters
    ----------
    mean : (3, 3) attitude of the IMU over the whole path
    """
    effects = np.zeros((len(away), 6, 3))
    effects[:, 0], effects[:, 1] = -mean[1], mean[0]
    effects[:, 3:] = np.cross(effects[:, :3], away[:, :, None], axis=1)
    return effects


def of_slope(away: Array) -> Array:
    """Return effects (K, 6, 2) of a level that rises along x, and along y."""
    effects = np.zeros((len(away), 6, 2))
    effects[:, 5] = away[:, :2]
    return effects


def of_scale(away: Array) -> Array:
    """Return effects (K, 6, 1) of a map that is too large."""
    effects = np.zeros((len(away), 6, 1))
    effects[:, 3:, 0] = away
    return effects
