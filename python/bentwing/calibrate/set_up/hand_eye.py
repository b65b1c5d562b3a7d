# SPDX-License-Identifier: MIT OR Apache-2.0
"""How the readings of an IMU follow the lidar's own motion: delay, rotation, scale, handedness.

The rates of two sensors on one carrier differ by a constant rotation and a delay only, so both follow
from their covariance (hand-eye calibration; the rotation by Kabsch's method). Nothing is assumed
about the axes: a reading that is mirrored shows as an orthogonal matrix of determinant -1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.calibrate.set_up.motion import HALF
from bentwing.calibrate.set_up.signals import HIDDEN, Averages, smoothed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.calibrate.set_up.motion import LidarMotion
    from bentwing.recording import ImuBatch

LARGEST_DELAY = 5.0  # s
COARSE, FINE = 0.02, 0.001  # s
LEAST_OVERLAP = 5.0  # s
SHORT_HALF = 0.01  # s, of the forces before they are smoothed


@dataclass(frozen=True, slots=True)
class GyroFit:
    """How the gyro follows the lidar: `gyro(t - delay) = scale · M · rates(t) + offset`.

    Attributes
    ----------
    delay : s, lidar stamps minus IMU clock
    M : (3, 3) orthogonal, from the lidar's frame to the axes of the gyro
    mirrored_M : (3, 3) the best of the other handedness
    scale : of the gyro
    correlation : of the delayed readings with the motion, 0 to 1, in any rotation
    left : share of the gyro's variation that M does not explain; `mirrored_left` of the other one
    """

    delay: float
    M: NDArray[np.float64]
    mirrored_M: NDArray[np.float64]
    scale: float
    correlation: float
    left: float
    mirrored_left: float


@dataclass(frozen=True, slots=True)
class AccelFit:
    """How the accelerometer follows the lidar: `R Cᵀ f = gravity + slope · acceleration`.

    Attributes
    ----------
    C : (3, 3) orthogonal, from the lidar's frame to the axes of the accelerometer
    gravity : (3,) m/s², map of the lidar's odometry
    slope : of the accelerations; 1 where the lidar's ranges are in metres
    left : m/s², what remains
    """

    C: NDArray[np.float64]
    gravity: NDArray[np.float64]
    slope: float
    left: float


def fit_gyro(motion: LidarMotion, imu: ImuBatch, delays: Sequence[float] | None = None) -> GyroFit:
    """Fit delay, rotation and scale to angular rates.

    Parameters
    ----------
    delays : s, to choose from; default: `LARGEST_DELAY` either way
    """
    gyro = Averages(imu.times, imu.gyro)
    if delays is None:
        tried = np.arange(-LARGEST_DELAY, LARGEST_DELAY + COARSE, COARSE)
        coarse = max(tried, key=lambda delay: _correlation(motion, gyro, delay))
        delays = [*np.arange(coarse - COARSE, coarse + COARSE, FINE)]
    delay = float(max(delays, key=lambda d: _correlation(motion, gyro, d)))
    rates, readings = _pairs(motion, gyro, delay)
    direct, mirrored = (_orthogonal(rates, readings, hand) for hand in (1.0, -1.0))
    if direct[2] <= mirrored[2]:
        best, other = direct, mirrored
    else:
        best, other = mirrored, direct
    return GyroFit(
        delay,
        best[0],
        other[0],
        best[1],
        _correlation(motion, gyro, delay),
        best[2],
        other[2],
    )


def fit_accel(motion: LidarMotion, imu: ImuBatch, delay: float, C: NDArray[np.float64]) -> AccelFit:
    """Fit gravity and the slope of the accelerations for axes C (3, 3)."""
    accel = Averages(imu.times, imu.accel)
    known = accel.covers(motion.times - delay, SHORT_HALF)
    force = accel.about(motion.times[known] - delay, SHORT_HALF)
    # In the map before it is smoothed: the head turns meanwhile.
    in_map = smoothed(np.einsum("nij,nj->ni", motion.R[known], force @ C))
    acceleration = motion.accelerations[known][HIDDEN : len(force) - HIDDEN]
    gravity, slope = in_map.mean(axis=0), 1.0
    varied = acceleration - acceleration.mean(axis=0)
    if (power := float((varied**2).sum())) > 0.0:
        slope = float((varied * in_map).sum()) / power
        gravity = (in_map - slope * acceleration).mean(axis=0)
    left = in_map - gravity - slope * acceleration
    return AccelFit(C, gravity, slope, float(np.sqrt((left**2).sum(axis=1).mean())))


def _pairs(
    motion: LidarMotion, gyro: Averages, delay: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lidar's rates and the gyro's, (N, 3) each, without their means."""
    known = gyro.covers(motion.times - delay, HALF)
    rates = motion.rates[known]
    readings = gyro.about(motion.times[known] - delay, HALF)
    if not len(rates):
        return rates, readings
    return rates - rates.mean(axis=0), readings - readings.mean(axis=0)


def _correlation(motion: LidarMotion, gyro: Averages, delay: float) -> float:
    """Return how well some rotation of the rates, mirrored or not, gives the readings."""
    rates, readings = _pairs(motion, gyro, delay)
    step = float(motion.times[1] - motion.times[0])
    power = np.sqrt((rates**2).sum() * (readings**2).sum())
    if len(rates) * step < LEAST_OVERLAP or power == 0.0:
        return 0.0
    return float(np.linalg.svd(rates.T @ readings, compute_uv=False).sum() / power)


def _orthogonal(
    rates: NDArray[np.float64], readings: NDArray[np.float64], hand: float
) -> tuple[NDArray[np.float64], float, float]:
    """Return rotation or reflection (3, 3), scale, and the share of the readings they leave."""
    U, values, Vt = np.linalg.svd(readings.T @ rates)
    signs = np.array([1.0, 1.0, hand * np.sign(np.linalg.det(U @ Vt))])
    M = (U * signs) @ Vt
    scale = float((values * signs).sum() / max(float((rates**2).sum()), 1e-12))
    left = readings - scale * rates @ M.T
    return M, scale, float(np.sqrt((left**2).sum() / max(float((readings**2).sum()), 1e-12)))
