# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is free and what is occupied around the carrier, from the last half revolution of points.

An occupancy grid (Elfes 1989; Kaul 2015, section 5) of log odds that moves with the carrier and
forgets: a head sees each place once per half revolution, so evidence lasts a little longer than that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.flight.control.checks import require_positive

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class GridSettings:
    """Size and memory of the grid.

    Attributes
    ----------
    cell : m, edge of a cell
    reach : m, from the carrier to the sides; nothing farther away is kept
    below, above : m, part of space in which the carrier could touch something, from its origin
    half_turn : s, in which the head sees everything once
    hit, miss : log odds of one scan that ends in a cell, or passes through it
    most : log odds, beyond which evidence does not accumulate
    occupied : log odds above which a cell counts as occupied, and below minus which as free
    """

    cell: float = 0.1
    reach: float = 4.0
    below: float = 0.45
    above: float = 0.25
    half_turn: float = 0.75
    hit: float = 1.4
    miss: float = 0.7
    most: float = 2.1
    occupied: float = 0.5

    def __post_init__(self) -> None:
        require_positive({name: getattr(self, name) for name in self.__slots__})

    @property
    def memory(self) -> float:
        """Time constant, s: one hit is forgotten after 1.5 half turns."""
        return 1.5 * self.half_turn / math.log(self.hit / self.occupied)


class OccupancyGrid:
    """Log odds (X, Y, Z) of cells around the carrier, in a level frame that does not move.

    Each cell remembers when it was last told something and fades from then on, so that a scan costs
    no more than the cells it touches.
    """

    def __init__(self, settings: GridSettings) -> None:
        self.settings = settings
        cells = 2 * math.ceil(settings.reach / settings.cell) + 1
        layers = math.ceil((settings.below + settings.above) / settings.cell)
        self._odds = np.zeros((cells, cells, layers))
        self._told = np.zeros_like(self._odds)
        self._corner: NDArray[np.int64] | None = None

    def clear(self) -> None:
        """Forget everything."""
        self._odds[:] = 0.0
        self._corner = None

    def add(self, time: float, origin: Array, points: Array) -> None:
        """Take points (N, 3) seen from `origin` (3,), m, level frame, checked by the caller."""
        s = self.settings
        self._follow(origin)
        change = np.zeros(self._odds.size)
        change[self._passed(origin, points)] = -s.miss
        # A ray that grazes a surface passes through cells where others end: those count as hit.
        change[self._cells(*points.T)] = s.hit
        cells = np.flatnonzero(change)
        odds, told = self._odds.reshape(-1), self._told.reshape(-1)
        faded = odds[cells] * np.exp((told[cells] - time) / s.memory)
        odds[cells] = np.clip(faded + change[cells], -s.most, s.most)
        told[cells] = time

    def occupied(self, time: float) -> Array:
        """Return the centres (K, 2), m, of columns that are occupied at any height."""
        return self._centres(self._columns(time, self._odds > self.settings.occupied))

    def free(self, time: float) -> Array:
        """Return the centres (K, 2), m, of columns seen free at some height, occupied at none."""
        seen = self._columns(time, self._odds < -self.settings.occupied)
        taken = self._columns(time, self._odds > self.settings.occupied)
        return self._centres(seen & ~taken)

    def _columns(self, time: float, candidates: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Columns (X, Y) of which a candidate has not faded below the threshold by now."""
        columns = np.zeros(self._odds.shape[:2], bool)
        x, y, z = np.nonzero(candidates)
        age = np.maximum(time - self._told[x, y, z], 0.0)
        odds = np.abs(self._odds[x, y, z]) * np.exp(-age / self.settings.memory)
        lasting = odds > self.settings.occupied
        columns[x[lasting], y[lasting]] = True
        return columns

    def _centres(self, columns: NDArray[np.bool_]) -> Array:
        if self._corner is None:
            return np.empty((0, 2))
        return np.asarray((np.argwhere(columns) + self._corner[:2] + 0.5) * self.settings.cell)

    def _follow(self, origin: Array) -> None:
        """Keep the carrier in the middle; what comes in at the edges is unknown."""
        half = (self._odds.shape[0] - 1) // 2
        low = np.array([origin[0], origin[1], origin[2] - self.settings.below])
        corner = np.floor(low / self.settings.cell).astype(np.int64) - np.array([half, half, 0])
        if self._corner is not None and (corner != self._corner).any():
            self._shift(corner - self._corner)
        self._corner = corner

    def _shift(self, by: NDArray[np.int64]) -> None:
        odds, told = np.zeros_like(self._odds), np.zeros_like(self._told)
        kept = [slice(max(0, -b), max(0, n - b)) for b, n in zip(by, odds.shape, strict=True)]
        taken = [slice(max(0, b), max(0, n + b)) for b, n in zip(by, odds.shape, strict=True)]
        odds[tuple(kept)], told[tuple(kept)] = self._odds[tuple(taken)], self._told[tuple(taken)]
        self._odds, self._told = odds, told

    def _cells(self, x: Array, y: Array, z: Array) -> NDArray[np.int64]:
        """Flat indices of the cells of those places that are in the grid."""
        assert self._corner is not None  # `_follow` has been called
        per_metre = 1.0 / self.settings.cell
        i, j, k = (
            np.floor(values * per_metre).astype(np.int64) - low
            for values, low in zip((x, y, z), self._corner, strict=True)
        )
        n, m, layers = self._odds.shape
        inside = (i >= 0) & (i < n) & (j >= 0) & (j < m) & (k >= 0) & (k < layers)
        return np.asarray(((i * m + j) * layers + k)[inside])

    def _passed(self, origin: Array, points: Array) -> NDArray[np.int64]:
        """Cells that the rays pass through before they end, sampled once per cell's edge."""
        s = self.settings
        rays = points - origin
        ranges = np.maximum(np.linalg.norm(rays, axis=1), 1e-9)
        x, y, z = rays.T / ranges
        # Where a ray leaves the part of space that is kept.
        rise = np.abs(z) / np.where(z > 0, s.above, s.below)
        leaves = 1.0 / np.maximum(np.maximum(rise, np.hypot(x, y) / s.reach), 1e-9)
        counts = (np.minimum(leaves, ranges - s.cell) / s.cell).astype(np.int64).clip(0)
        rows = np.repeat(np.arange(len(points)), counts)
        steps = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
        along = (steps + 0.5) * s.cell
        return self._cells(
            origin[0] + along * x[rows], origin[1] + along * y[rows], origin[2] + along * z[rows]
        )
