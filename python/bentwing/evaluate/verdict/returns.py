# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the returns of a lidar look like."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.odometry.planar import is_plane

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording.batches import LidarBatch

# One of so many returns is looked at.
_EVERY = 37
# A 3D lidar shows itself in the first batches.
_JUDGED = 10
_FEWEST = 3
# Neighbours are looked at in one of so many batches, so many returns of it.
_LOOKS, _LOOKED, _MOST = 10, 4000, 500
_FEWEST_STEPS = 20
# Between successive returns, as a logarithm; then those in neighbouring directions are looked at, too.
_UNRELATED = 0.1
_AGREE = 0.3  # of what successive returns differ by
# A return whose neighbour is known by no beam number has it one of so many returns before.
_STRIDES = (1, 2, 4, 6, 8, 16, 32, 64, 128)


class Returns:
    """Sums over some of the returns.

    Attributes
    ----------
    normal : (3,) unit, lidar frame, of the plane in which a 2D lidar scans; None if it is none
    """

    def __init__(self) -> None:
        self.normal: NDArray[np.float64] | None = None
        self._n_judged = 0
        self._n = 0
        self._sums = np.zeros(2)
        self._n_batches = 0
        self._steps: list[float] = []
        self._aside: list[float] = []

    def add(self, batch: LidarBatch) -> None:
        """Take the next returns."""
        if self._n_judged < _JUDGED and len(batch.times) >= _FEWEST:
            self._judge(batch.points)
        some = batch.points[::_EVERY]
        ranges = np.log(np.maximum(np.linalg.norm(some, axis=1), 1e-3))
        self._n += len(ranges)
        self._sums += ranges.sum(), (ranges**2).sum()
        if self._n_batches % _LOOKS == 0 and len(self._steps) < _MOST:
            self._look(batch)
        self._n_batches += 1

    @property
    def spread(self) -> float:
        """Standard deviation of the logarithm of the ranges; infinite without returns."""
        if not self._n:
            return np.inf
        mean, square = self._sums / self._n
        return float(np.sqrt(max(square - mean**2, 0.0)))

    @property
    def scatter(self) -> float:
        """How far a return's range usually is from its neighbour's, as a logarithm; zero without returns."""
        return float(np.median(self._steps)) if self._steps else 0.0

    @property
    def is_out_of_order(self) -> bool:
        """Whether ranges agree in neighbouring directions, but not those of successive returns."""
        return bool(self._aside) and float(np.median(self._aside)) < _AGREE * self.scatter

    def _look(self, batch: LidarBatch) -> None:
        points = batch.points[:_LOOKED]
        ranges = np.maximum(np.linalg.norm(points, axis=1), 1e-3)
        logs = np.log(ranges)
        if batch.ring is not None:
            rings = batch.ring[:_LOOKED]
            beams, counts = np.unique(rings, return_counts=True)
            steps = [_step(logs[rings == beams[np.argmax(counts)]], 1)]
        else:
            steps = [_step(logs, stride) for stride in _STRIDES]
        if known := [step for step in steps if step is not None]:
            self._steps.append(min(known))
            if min(known) > _UNRELATED:
                self._aside.append(_step_aside(points / ranges[:, None], logs))

    def _judge(self, points: NDArray[np.float64]) -> None:
        self._n_judged += 1
        if is_plane(points):
            self.normal = np.linalg.eigh(np.cov(points.T))[1][:, 0]
        else:
            self.normal, self._n_judged = None, _JUDGED


def _step(logs: NDArray[np.float64], stride: int) -> float | None:
    """Median step between ranges (N,), as logarithms; None of too few."""
    if len(logs) < stride + _FEWEST_STEPS:
        return None
    return float(np.median(np.abs(logs[stride:] - logs[:-stride])))


def _step_aside(directions: NDArray[np.float64], logs: NDArray[np.float64]) -> float:
    """Median step from ranges (N,), as logarithms, to those in the nearest directions (N, 3)."""
    # Slow to import, and needed for recordings that are wrong only.
    from scipy.spatial import cKDTree

    _, nearest = cKDTree(directions).query(directions, k=2)
    return float(np.median(np.abs(logs[nearest[:, 1]] - logs)))
