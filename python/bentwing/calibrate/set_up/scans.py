# SPDX-License-Identifier: MIT OR Apache-2.0
"""The scans of a 2D lidar as ranges by direction, to compare them with each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording import ImuBatch, LidarBatch

N_BEAMS = 120
MOST_DIFFERENT = 0.5  # of the logarithm of a range: what one scan does not see counts no more
STEP = 0.01  # s between scans that are compared, at most the scan rate
SOON = 0.1  # s in which a head that turns sees something else
STILL = 0.3  # of what scans usually change in that time


class Scans:
    """Ranges by direction, for each scan.

    Attributes
    ----------
    times : (S,) s, middle of each scan, evenly spaced by `interval`
    ranges : (S, N_BEAMS) their logarithms, of m; NaN where there is none
    """

    def __init__(self, lidar: LidarBatch) -> None:
        points, times = lidar.points, lidar.times
        azimuths = np.arctan2(points[:, 1], points[:, 0])
        starts = np.concatenate([[0], np.flatnonzero(np.abs(np.diff(azimuths)) > 1.0) + 1])
        lengths = np.diff([*starts, len(times)])
        rows = np.repeat(np.arange(len(starts)), lengths)
        profiles = np.full((len(starts), N_BEAMS), np.nan, np.float32)
        profiles[rows, beams(azimuths)] = np.log(np.maximum(np.linalg.norm(points, axis=1), 1e-3))
        middles = np.add.reduceat(times, starts) / lengths
        self.interval = max(STEP, float(np.median(np.diff(middles)))) if len(middles) > 1 else STEP
        self.times = np.arange(middles[0], middles[-1], self.interval)
        nearest = np.clip(np.searchsorted(middles, self.times), 0, len(middles) - 1)
        self.ranges = profiles[nearest]

    @property
    def changing(self) -> NDArray[np.bool_]:
        """(S,) which scans see something else than those soon after: whether the head turns."""
        lag = min(max(1, round(SOON / self.interval)), len(self.times) - 1)
        if lag < 1:
            return np.ones(len(self.times), np.bool_)
        apart = np.abs(self.ranges[lag:] - self.ranges[:-lag])
        known = np.isfinite(apart)
        total = np.where(known, np.minimum(apart, MOST_DIFFERENT), 0.0).sum(axis=1)
        changes = total / np.maximum(known.sum(axis=1), 1)
        changes = np.append(changes, np.full(lag, changes[-1]))
        return np.asarray(changes >= STILL * np.median(changes))


def beams(azimuths: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return in which beam directions (N,), rad, lie."""
    return np.floor((azimuths / (2 * np.pi) + 0.5) * N_BEAMS).astype(np.int64) % N_BEAMS


def attitudes(imu: ImuBatch) -> NDArray[np.float64]:
    """Return the attitude (M, 4) at each inertial sample by the gyro alone; rates in rad/s."""
    mid = (imu.gyro[1:] + imu.gyro[:-1]) / 2 * np.diff(imu.times)[:, None]
    quats = np.vstack([[0.0, 0.0, 0.0, 1.0], geometry.exp(mid)])
    width = 1
    while width < len(quats):  # products of all that came before, by doubling
        quats[width:] = geometry.multiply(quats[:-width], quats[width:])
        width *= 2
    return np.asarray(quats)
