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

    def add(self, batch: LidarBatch) -> None:
        """Take the next returns."""
        if self._n_judged < _JUDGED and len(batch.times) >= _FEWEST:
            self._judge(batch.points)
        some = batch.points[::_EVERY]
        ranges = np.log(np.maximum(np.linalg.norm(some, axis=1), 1e-3))
        self._n += len(ranges)
        self._sums += ranges.sum(), (ranges**2).sum()

    @property
    def spread(self) -> float:
        """Standard deviation of the logarithm of the ranges; infinite without returns."""
        if not self._n:
            return np.inf
        mean, square = self._sums / self._n
        return float(np.sqrt(max(square - mean**2, 0.0)))

    def _judge(self, points: NDArray[np.float64]) -> None:
        self._n_judged += 1
        if is_plane(points):
            self.normal = np.linalg.eigh(np.cov(points.T))[1][:, 0]
        else:
            self.normal, self._n_judged = None, _JUDGED
