# SPDX-License-Identifier: MIT OR Apache-2.0
"""How far a lever arm is off because an accelerometer reads otherwise in flight than at rest.

Vibration adds to the bias of an accelerometer, and where a head begins to spin as its carrier takes off, this
looks as if the IMU were elsewhere: 0.04 m/s² at 5 rad/s are 1.6 mm. A bias that was known at rest is taken for that
of the flight, so that no residual shows it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.odometry.continuous.slow_states import INITIAL_STD

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.recording.sections.imu import Imu

    Array = NDArray[np.float64]

# m/s², of what vibration adds to the bias of each axis: as much as any bias that is not known.
_ADDED = INITIAL_STD["accel_bias"]
_STEP = 0.05  # s, over which rates are taken: shorter ones are noise
_MOVED, _TURNED = 0.02, 0.05  # m and rad, that show that a rest is over


def lever_covariance(trajectory: Trajectory, imu: Imu | None) -> Array:
    """Return what adds to the covariance (3, 3) of the lever arm, m², IMU frame.

    Parameters
    ----------
    imu : says how much its noise hides; without one there is no lever arm
    """
    n = int((trajectory.times[-1] - trajectory.times[0]) / _STEP)
    if imu is None or n < 4:
        return np.zeros((3, 3))
    # The last of whole steps may be rounded beyond the end.
    times = np.minimum(trajectory.times[0] + _STEP * np.arange(n + 1), trajectory.times[-1])
    positions, quats = trajectory.interpolate(times)
    turned = geometry.log(geometry.multiply(geometry.inverse(quats[:-1]), quats[1:])) / _STEP
    rates, accelerations = 0.5 * (turned[1:] + turned[:-1]), np.diff(turned, axis=0) / _STEP
    # The force by a lever arm is `felt` times it; of a bias that is constant nothing is left about the mean.
    felt = _hats(rates) @ _hats(rates) + _hats(accelerations)
    felt -= felt.mean(axis=0)
    flies = _flies(positions, quats)[1:-1].astype(np.float64)
    confused = np.tensordot(flies - flies.mean(), felt, axes=1).T
    known = np.einsum("kji,kjl->il", felt, felt)
    variance = imu.accel_noise**2 / _STEP
    information = known / variance + np.eye(3) / INITIAL_STD["extrinsic_translation"] ** 2
    off = _ADDED * np.linalg.solve(information, confused / variance)
    return np.asarray(off @ off.T)


def _flies(positions: Array, quats: Array) -> NDArray[np.bool_]:
    """Return where (K,) the rest at the start is over."""
    moved = np.linalg.norm(positions - positions[0], axis=1) > _MOVED
    turns = geometry.multiply(np.broadcast_to(geometry.inverse(quats[:1]), quats.shape), quats)
    turned = np.linalg.norm(geometry.log(turns), axis=1) > _TURNED
    return np.asarray(np.logical_or.accumulate(moved | turned))


def _hats(vectors: Array) -> Array:
    """Return the matrices (K, 3, 3) of cross products with vectors (K, 3)."""
    return np.cross(vectors[:, None], np.eye(3)).transpose(0, 2, 1)
