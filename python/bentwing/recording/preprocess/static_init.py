# SPDX-License-Identifier: MIT OR Apache-2.0
"""Find the stretch at the start in which the payload stood still, and what it tells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

MAX_DEPARTURE = 0.08  # rad/s from the median; more is motion
MARGIN = 0.3  # s before the departure that may already be motion
MIN_STATIC = 0.5  # s
# A steady turn does not depart from its median. More than the bias of a calibrated gyro is a turn.
MAX_REST_RATE = 0.1  # rad/s
MAX_ACCEL_CHANGE = 0.3  # m/s² between the halves of the stretch; more is tilting or driving off
SMOOTHING = 0.05  # s; single samples leave the median by vibration alone
# A carrier without a spinning payload may lift off without turning: then the force tells.
MAX_FORCE_DEPARTURE = 0.15  # m/s² from the median
FORCE_SMOOTHING = 0.2  # s; rotors shake the accelerometer by 1 m/s² and more
BLOCK = 0.25  # s; vibration averages out within it, what remains is the error of the mean


@dataclass(frozen=True, slots=True)
class StaticStart:
    """What a static start tells.

    Attributes
    ----------
    start, end : s, of the stretch
    n_samples : IMU samples in it
    gyro_bias, gyro_bias_std : (3,) rad/s, imu frame; real standard deviation of the mean
    accel_mean, accel_std : (3,) m/s², imu frame; real standard deviation of the mean
    R_map_imu : (3, 3), z up and yaw 0
    """

    start: float
    end: float
    n_samples: int
    gyro_bias: NDArray[np.float64]
    gyro_bias_std: NDArray[np.float64]
    accel_mean: NDArray[np.float64]
    accel_std: NDArray[np.float64]
    R_map_imu: NDArray[np.float64]


def find_static_start(
    times: NDArray[np.float64],
    gyro: NDArray[np.float64],
    accel: NDArray[np.float64],
    *,
    gyro_bias_walk: float = 1.0e-5,
    accel_bias_walk: float = 1.0e-4,
) -> StaticStart | None:
    """Return the static stretch at the start, or None where the recording starts in motion.

    Parameters
    ----------
    times : (M,) s, increasing
    gyro : (M, 3) rad/s, imu frame
    accel : (M, 3) m/s², imu frame
    gyro_bias_walk, accel_bias_walk : rad/s²/√Hz, m/s³/√Hz

    Returns
    -------
    StaticStart or None
        None where less than 0.5 s is static: the estimator then starts with wide priors.
    """
    n = _static_samples(times, gyro, accel)
    if n < 2 or times[n - 1] - times[0] < MIN_STATIC:
        return None
    times, gyro, accel = times[:n], gyro[:n], accel[:n]
    change = accel[n // 2 :].mean(axis=0) - accel[: n // 2].mean(axis=0)
    if np.linalg.norm(np.median(gyro, axis=0)) > MAX_REST_RATE:
        return None
    if np.linalg.norm(change) > MAX_ACCEL_CHANGE:
        return None
    accel_mean = accel.mean(axis=0)
    return StaticStart(
        float(times[0]),
        float(times[-1]),
        n,
        gyro.mean(axis=0),
        _std_of_mean(times, gyro, gyro_bias_walk),
        accel_mean,
        _std_of_mean(times, accel, accel_bias_walk),
        level_attitude(accel_mean),
    )


def level_attitude(accel: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return R_map_imu (3, 3) that turns the specific force (3,) at rest to +z, with yaw 0."""
    x, y, z = accel
    roll, pitch = np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z))
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    # Ry(pitch) · Rx(roll)
    return np.array([[cp, sp * sr, sp * cr], [0.0, cr, -sr], [-sp, cp * sr, cp * cr]])


def _static_samples(
    times: NDArray[np.float64], gyro: NDArray[np.float64], accel: NDArray[np.float64]
) -> int:
    """Return how many samples at the start are static.

    The median is that of the first half second, then that of the stretch found with it: over a
    whole recording it would be that of the motion.
    """
    if len(times) < 2:
        return 0
    n = int(np.searchsorted(times, times[0] + MIN_STATIC))
    rate, force = _smoothed(times, gyro, SMOOTHING), _smoothed(times, accel, FORCE_SMOOTHING)
    for _ in range(2):
        if n < 2:
            return 0
        departed = _departs(rate, gyro[:n], MAX_DEPARTURE)
        departed |= _departs(force, accel[:n], MAX_FORCE_DEPARTURE)
        if not departed.any():
            return len(times)
        end = times[int(np.argmax(departed))] - MARGIN
        n = int(np.searchsorted(times, end, side="right"))
    return n


def _departs(
    smooth: NDArray[np.float64], rest: NDArray[np.float64], limit: float
) -> NDArray[np.bool_]:
    """Tell which samples (M, 3) are farther than `limit` from the median of the rest (K, 3)."""
    return np.asarray(np.linalg.norm(smooth - np.median(rest, axis=0), axis=1) > limit)


def _smoothed(
    times: NDArray[np.float64], values: NDArray[np.float64], width: float
) -> NDArray[np.float64]:
    """Return the moving average of values (M, 3) over `width` seconds."""
    dt = float(np.median(np.diff(times)))
    half = int(width / max(dt, 1e-6) / 2)
    total = np.vstack([np.zeros(3), np.cumsum(values, axis=0)])
    index = np.arange(len(values))
    low, high = np.maximum(index - half, 0), np.minimum(index + half + 1, len(values))
    return np.asarray((total[high] - total[low]) / (high - low)[:, None])


def _std_of_mean(
    times: NDArray[np.float64], values: NDArray[np.float64], bias_walk: float
) -> NDArray[np.float64]:
    """Return the standard deviation (3,) of the mean as an estimate of the value at the end.

    Vibration and slow drift correlate the samples, so the spread of block means counts, not that
    of samples. A bias walking for T seconds ends bias_walk·√(T/3) from its mean.
    """
    duration = float(times[-1] - times[0])
    n_blocks = min(max(2, int(duration / BLOCK)), len(values))
    means = np.array([block.mean(axis=0) for block in np.array_split(values, n_blocks)])
    white = values.std(axis=0, ddof=1) / np.sqrt(len(values))
    blocked = means.std(axis=0, ddof=1) / np.sqrt(n_blocks)
    return np.asarray(np.sqrt(np.maximum(white, blocked) ** 2 + bias_walk**2 * duration / 3))
