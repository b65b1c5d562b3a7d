# SPDX-License-Identifier: MIT OR Apache-2.0
"""Attitude by the gyro alone: over the seconds between two poses it is better than any straight line."""

from __future__ import annotations

import numpy as np

from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory
from bentwing.recording.preprocess.static_init import find_static_start


def rest_bias(times: np.ndarray, gyro: np.ndarray, accel: np.ndarray) -> np.ndarray:
    """Bias (3,) of the gyro from the rest at the start; zero where there is none."""
    rest = find_static_start(times, gyro, accel)
    return np.zeros(3) if rest is None else rest.gyro_bias


def integrated(times: np.ndarray, gyro: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """Attitudes (M, 4) at `times` (M,) s relative to the first, from rates (M, 3) rad/s."""
    rates = gyro - bias
    steps = geometry.exp(0.5 * (rates[1:] + rates[:-1]) * np.diff(times)[:, None])
    quats = np.empty((len(times), 4))
    quats[0] = geometry.IDENTITY_QUAT_XYZW
    for i, step in enumerate(steps):
        quats[i + 1] = geometry.multiply(quats[i], step)
    return quats / np.linalg.norm(quats, axis=1, keepdims=True)


def as_trajectory(times: np.ndarray, quats: np.ndarray) -> Trajectory:
    """Attitudes as a trajectory that stays where it is, to be interpolated."""
    return Trajectory(times, np.zeros((len(times), 3)), quats)


def densified(sparse: Trajectory, turning: Trajectory) -> Trajectory:
    """Fill in the poses between those of a few per second, as every reader of them would have to.

    The attitude between two poses follows the gyro, whose error over that time is spread evenly;
    the position is the cubic through the neighbouring poses.

    Parameters
    ----------
    sparse : poses of the IMU
    turning : attitude by the gyro at the times to fill in, e.g. of the IMU's samples
    """
    inside = sparse.covers(turning.times) & ~np.isin(turning.times, sparse.times)
    known = turning.covers(sparse.times)
    sparse = Trajectory(sparse.times[known], sparse.positions[known], sparse.quats_xyzw[known])
    times = np.union1d(turning.times[inside & sparse.covers(turning.times)], sparse.times)
    i = np.clip(np.searchsorted(sparse.times, times, side="right") - 1, 0, len(sparse.times) - 2)
    shares = (times - sparse.times[i]) / (sparse.times[i + 1] - sparse.times[i])
    _, at_poses = turning.interpolate(sparse.times)
    _, at_times = turning.interpolate(times)
    whole = _turned(at_poses[i], at_poses[i + 1])
    error = geometry.log(_turned(whole, _turned(sparse.quats_xyzw[i], sparse.quats_xyzw[i + 1])))
    followed = geometry.multiply(sparse.quats_xyzw[i], _turned(at_poses[i], at_times))
    quats = geometry.multiply(followed, geometry.exp(shares[:, None] * error))
    return Trajectory(times, _cubic(sparse, i, shares), quats)


def _turned(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return geometry.multiply(geometry.inverse(a), b)


def _cubic(sparse: Trajectory, i: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Position by Hermite's cubic, with velocities by differences of the poses around."""
    velocities = np.gradient(sparse.positions, sparse.times, axis=0)
    step = np.diff(sparse.times)[i][:, None]
    u = shares[:, None]
    p0, p1 = sparse.positions[i], sparse.positions[i + 1]
    m0, m1 = velocities[i] * step, velocities[i + 1] * step
    return (
        (2 * u**3 - 3 * u**2 + 1) * p0
        + (u**3 - 2 * u**2 + u) * m0
        + (3 * u**2 - 2 * u**3) * p1
        + (u**3 - u**2) * m1
    )
