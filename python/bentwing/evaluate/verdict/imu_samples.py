# SPDX-License-Identifier: MIT OR Apache-2.0
"""What inertial samples look like: how often they come, repeat and end at a limit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.preprocess.imu_limits import LEAST_LIMIT

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording.batches import ImuBatch


class ImuSamples:
    """Counts over the samples of an IMU.

    Attributes
    ----------
    n : samples
    first, last : s
    """

    def __init__(self) -> None:
        self.n = 0
        self.first, self.last = np.inf, -np.inf
        self._n_repeated = 0
        self._before = np.full((1, 6), np.nan)
        # Of each axis, the least and the greatest value, and how often it was there twice in a row.
        self._ends = np.full((2, 6), -np.inf)
        self._n_at_end = np.zeros((2, 6), np.int64)
        self._n_bridged = np.zeros(2, np.int64)

    def add(self, batch: ImuBatch) -> None:
        """Take the next samples."""
        values = np.hstack([batch.gyro, batch.accel])
        stays = values == np.vstack([self._before, values[:-1]])
        self._n_repeated += int(stays.all(axis=1).sum())
        for end, signed in enumerate((values, -values)):
            self._watch_end(end, signed, stays)
        self._before = values[-1:]
        if batch.at_limit is not None:
            self._n_bridged += batch.at_limit.reshape(-1, 2, 3).any(axis=2).sum(axis=0)
        self.n += len(values)
        self.first = min(self.first, float(batch.times[0]))
        self.last = max(self.last, float(batch.times[-1]))

    @property
    def length(self) -> float:
        """Time from the first sample to the last, s."""
        return max(self.last - self.first, 0.0)

    @property
    def period(self) -> float:
        """Mean time between samples, s."""
        return self.length / (self.n - 1) if self.n > 1 else np.inf

    @property
    def repeated_share(self) -> float:
        """Share of the samples that are the sample before once more."""
        return self._n_repeated / self.n if self.n else 0.0

    @property
    def constant(self) -> tuple[str, ...]:
        """Names of the instruments that have given one value all the time."""
        extent = (self._ends[0] + self._ends[1]).reshape(2, 3).max(axis=1)
        names = zip(("gyro", "accelerometer"), extent, strict=True)
        return tuple(name for name, far in names if self.n > 1 and far == 0.0)

    @property
    def limits(self) -> tuple[float, float]:
        """Share of the samples of the gyro and of the accelerometer that stay at an end of an axis."""
        beyond = (np.abs(self._ends) > LEAST_LIMIT) & (self._ends[0] > -self._ends[1])
        shares = np.where(beyond, self._n_at_end, 0).max(axis=0) / max(self.n, 1)
        # Samples that repeat altogether are no limit.
        gyro, accel = np.maximum(shares - self.repeated_share, 0.0).reshape(2, 3).max(axis=1)
        return float(gyro), float(accel)

    @property
    def bridged(self) -> tuple[float, float]:
        """Share of the samples of the gyro and of the accelerometer whose limit estimators bridge."""
        gyro, accel = self._n_bridged / max(self.n, 1)
        return float(gyro), float(accel)

    def _watch_end(self, end: int, values: NDArray[np.float64], stays: NDArray[np.bool_]) -> None:
        highest = values.max(axis=0)
        is_new = highest > self._ends[end]
        self._n_at_end[end][is_new] = 0
        self._ends[end] = np.maximum(highest, self._ends[end])
        self._n_at_end[end] += (stays & (values == self._ends[end])).sum(axis=0)
