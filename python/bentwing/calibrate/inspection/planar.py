# SPDX-License-Identifier: MIT OR Apache-2.0
"""Checks for a 2D lidar: whether its plane sweeps space, and the gyro turns with the scans."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording.batches import LidarBatch

N_BEAMS = 360  # azimuth bins of 1°
MAX_SHIFT = 30  # bins between consecutive scans
MAX_DIFFERENCE = 0.3  # m
MAX_SCANS = 1000
MIN_TURN = 0.03  # rad between scans, below which the bins do not resolve a turn
MIN_TURNS = 10
MIN_CORRELATION = 0.7
LEVEL = np.radians(15)  # tilt below which a plane counts as level


def level_share(accel: NDArray[np.float64], R_imu_lidar: NDArray[np.float64]) -> float:
    """Return the share of time in which the scan plane (z = 0 in the lidar frame) is level.

    Parameters
    ----------
    accel : (M, 3), imu frame, smoothed, any unit
    R_imu_lidar : (3, 3)
    """
    along_normal = np.abs(accel @ R_imu_lidar[:, 2])
    lengths = np.maximum(np.linalg.norm(accel, axis=1), 1e-9)
    return float((along_normal / lengths > np.cos(LEVEL)).mean())


class ScanTurns:
    """Turn of a level 2D lidar from scan to scan, by shifting range profiles onto each other.

    Parameters
    ----------
    period : s per scan where beams have times; None where all beams of a scan share one
    """

    def __init__(self, period: float | None) -> None:
        self._period = period
        self._profiles: dict[float, NDArray[np.float64]] = {}

    @property
    def is_full(self) -> bool:
        """Whether more scans would not change the agreement."""
        return len(self._profiles) >= MAX_SCANS

    def add(self, batch: LidarBatch) -> None:
        """Take the next points."""
        azimuths = np.degrees(np.arctan2(batch.points[:, 1], batch.points[:, 0]))
        bins = np.floor(azimuths).astype(np.int64) % N_BEAMS
        ranges = np.hypot(batch.points[:, 0], batch.points[:, 1])
        times = batch.times
        if self._period is not None:
            times = (np.floor(times / self._period) + 0.5) * self._period
        for time in np.unique(times):
            profile = self._profiles.setdefault(float(time), np.full(N_BEAMS, np.nan))
            scan = times == time
            profile[bins[scan]] = ranges[scan]

    def agreement(self, times: NDArray[np.float64], rates: NDArray[np.float64]) -> float | None:
        """Correlation of the scans' turns with the gyro's; None where it cannot be told.

        Near 1 the scan plane turns in itself, near -1 a gyro axis is mirrored; a plane that
        sweeps space correlates with nothing.

        Parameters
        ----------
        times : (M,) s
        rates : (M,) rad/s about the scan plane's normal, without bias
        """
        stamps = np.array(sorted(self._profiles))
        if len(stamps) < 2 or len(times) < 2:
            return None
        steps = (rates[1:] + rates[:-1]) / 2 * np.diff(times)
        turned = np.interp(stamps, times, np.concatenate([[0.0], np.cumsum(steps)]))
        by_gyro = np.diff(turned)
        by_scans = self._turns(stamps)
        # Only turns tell; scans at rest would only add the noise of the bins.
        tells = (np.abs(by_gyro) > MIN_TURN) & np.isfinite(by_scans)
        tells &= np.abs(by_gyro) < np.radians(MAX_SHIFT)
        if tells.sum() < MIN_TURNS:
            return None
        a, b = by_gyro[tells], by_scans[tells]
        norm = float(np.sqrt((a @ a) * (b @ b)))
        return float(a @ b) / norm if norm > 0 else None

    def _turns(self, stamps: NDArray[np.float64]) -> NDArray[np.float64]:
        profiles = [self._profiles[float(stamp)] for stamp in stamps]
        return np.array([_turn(a, b) for a, b in itertools.pairwise(profiles)])


def _turn(before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    """Return by how many rad the lidar turned, NaN where too little is seen in both."""
    shifts = np.arange(-MAX_SHIFT, MAX_SHIFT + 1)
    beams = (np.arange(N_BEAMS)[None, :] - shifts[:, None]) % N_BEAMS
    differences = np.abs(after[beams] - before[None, :])
    is_seen = np.isfinite(differences)
    if is_seen.sum(axis=1).min() < N_BEAMS // 4:
        return float("nan")
    # Clipping bounds the weight of what moves and of what comes into view.
    costs = np.where(is_seen, np.minimum(differences, MAX_DIFFERENCE), 0.0).sum(axis=1)
    costs /= is_seen.sum(axis=1)
    return float(np.radians(shifts[int(np.argmin(costs))]))
