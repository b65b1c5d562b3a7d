# SPDX-License-Identifier: MIT OR Apache-2.0
"""How much structure the lidar saw: a light measure from the ranges alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from bentwing.recording.batches import LidarBatch

BIN = 0.1  # m
N_BINS = 3000
FAR = 20.0  # m


@dataclass(frozen=True, slots=True)
class Structure:
    """What of the surroundings was visible.

    Attributes
    ----------
    n_points : valid returns
    valid_share : of all beams
    range_percentiles : m, at 5, 25, 50, 75 and 95 %
    far_share : of the valid returns, beyond 20 m
    """

    n_points: int
    valid_share: float
    range_percentiles: list[float]
    far_share: float


class StructureMeter:
    """Histogram of ranges over a recording, in bounded memory."""

    def __init__(self) -> None:
        self._histogram = np.zeros(N_BINS, dtype=np.int64)

    def add(self, batch: LidarBatch) -> None:
        """Take the next points."""
        ranges = np.sqrt(np.einsum("ij,ij->i", batch.points, batch.points))
        bins = np.minimum(ranges / BIN, N_BINS - 1).astype(np.int64)
        self._histogram += np.bincount(bins, minlength=N_BINS)

    def result(self, n_beams: int) -> Structure:
        """Return the measure; `n_beams` counts the returns and the beams without one."""
        n = int(self._histogram.sum())
        if n == 0:
            return Structure(0, 0.0, [], 0.0)
        cumulative = np.cumsum(self._histogram) / n
        percentiles = [
            float(np.searchsorted(cumulative, share) + 0.5) * BIN
            for share in (0.05, 0.25, 0.5, 0.75, 0.95)
        ]
        far = float(self._histogram[int(FAR / BIN) :].sum() / n)
        return Structure(n, n / max(n, n_beams), percentiles, far)
