# SPDX-License-Identifier: MIT OR Apache-2.0
"""The delay between lidar and IMU from the times at which the head comes back to an attitude.

Where the gyro says that the head has come back to where it pointed shortly before, the lidar must see
about the same again, wherever it is mounted. So the delay shows without knowing the mount, for a 2D
lidar as well, whose motion cannot be followed by itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.calibrate.set_up.scans import MOST_DIFFERENT, N_BEAMS, attitudes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.calibrate.set_up.scans import Scans
    from bentwing.recording import ImuBatch

SHORTEST, LONGEST = 0.1, 2.0  # s until the head comes back
LARGEST_DELAY = 3.0  # s
BACK, AWAY = np.radians(4.0), np.radians(20.0)
FEWEST = 100
NEARBY = 0.15  # s between delays that are worth a trial


def delays_by_returns(scans: Scans, imu: ImuBatch) -> list[tuple[float, float]]:
    """Return what scans differ by and lidar stamps minus IMU clock, s, where they differ least around.

    The likeliest comes first; none if motion tells none.

    Parameters
    ----------
    imu : rates in rad/s
    """
    if len(scans.times) < FEWEST or len(imu.times) < FEWEST:
        return []
    first, later = _pairs(scans.times, imu)
    if len(first) < FEWEST:
        return []
    steps = round(LARGEST_DELAY / scans.interval)
    delays = np.arange(-steps, steps + 1)
    returns = _Returns(scans)
    costs = np.array([returns.difference(first + delay, later + delay) for delay in delays])
    if np.isfinite(costs).sum() < len(costs) // 4:
        return []
    lowest = _lowest(costs, round(NEARBY / scans.interval))
    return [(float(costs[i]), float(delays[i] * scans.interval)) for i in lowest]


def _lowest(costs: NDArray[np.float64], apart: int) -> list[int]:
    """Return the lowest minima, `apart` from each other."""
    left = np.where(np.isfinite(costs), costs, np.inf)
    found: list[int] = []
    while np.isfinite(left).any():
        best = int(np.argmin(left))
        found.append(best)
        left[max(0, best - apart) : best + apart + 1] = np.inf
    return found


class _Returns:
    """How much scans differ from later ones, by how much later those are."""

    def __init__(self, scans: Scans) -> None:
        self._n = len(scans.times)
        width = round(LONGEST / scans.interval)
        self._differences = np.full((self._n, width), np.nan, np.float32)
        for lag in range(1, min(width, self._n)):
            apart = np.abs(scans.ranges[lag:] - scans.ranges[:-lag])
            seen = np.isfinite(apart)
            total = np.where(seen, np.minimum(apart, MOST_DIFFERENT), 0.0).sum(axis=1)
            count = seen.sum(axis=1)
            self._differences[:-lag, lag] = np.where(
                count > N_BEAMS // 6, total / np.maximum(count, 1), np.nan
            )
        usual = np.where(np.isfinite(self._differences), self._differences, 0.0).sum(axis=1)
        number = np.isfinite(self._differences).sum(axis=1)
        self._usual = np.where(number > 0, usual / np.maximum(number, 1), np.nan)

    def difference(self, first: NDArray[np.intp], later: NDArray[np.intp]) -> float:
        """Return how much scans differ from later ones (K,), in units of what is usual there."""
        inside = (first >= 0) & (later < self._n)
        if inside.sum() < FEWEST:
            return float("nan")
        apart = self._differences[first[inside], (later - first)[inside]]
        usual = self._usual[first[inside]]
        known = np.isfinite(apart) & np.isfinite(usual)
        if known.sum() < FEWEST:
            return float("nan")
        return float(apart[known].mean() / usual[known].mean())


def _pairs(times: NDArray[np.float64], imu: ImuBatch) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the numbers of times (S,) between which the head turned away and came back."""
    nearest = np.clip(np.searchsorted(imu.times, times), 0, len(imu.times) - 1)
    quats = attitudes(imu)[nearest]
    inside = np.flatnonzero((times >= imu.times[0]) & (times <= imu.times[-1]))
    if len(inside) < 2:
        return np.zeros(0, np.intp), np.zeros(0, np.intp)
    low, high = inside[0], inside[-1] + 1
    interval = float(times[1] - times[0])
    found: list[tuple[NDArray[np.intp], NDArray[np.intp]]] = []
    for lag in range(round(SHORTEST / interval), min(round(LONGEST / interval), high - low)):
        first = np.arange(low, high - lag)
        is_back = _angle(quats[first], quats[first + lag]) < BACK
        was_away = _angle(quats[first], quats[first + lag // 2]) > AWAY
        chosen = first[is_back & was_away]
        found.append((chosen, chosen + lag))
    first, later = (np.concatenate(part) for part in zip(*found, strict=True))
    return first, later


def _angle(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the angles (K,) between attitudes (K, 4), rad."""
    cosine = np.minimum(np.abs((a * b).sum(axis=1)), 1.0)
    return np.asarray(2.0 * np.arccos(cosine))
