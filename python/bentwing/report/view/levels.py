# SPDX-License-Identifier: MIT OR Apache-2.0
"""A map of any size as levels of detail that a viewer can hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.voxels import VoxelSet, voxel_keys

if TYPE_CHECKING:
    from numpy.typing import NDArray

FINEST = 0.02
"""m, edge of the voxels of the finest level, if the map is small enough."""
COARSER = 4.0
"""Ratio of the edges of two levels."""


@dataclass(frozen=True, slots=True)
class LevelPoints:
    """One point per voxel.

    Attributes
    ----------
    edge : m, of the voxels
    points : (N, 3) float32, m, map frame
    times : (N,) s since the recording's start, non-decreasing if those of the map are
    """

    edge: float
    points: NDArray[np.float32]
    times: NDArray[np.float64]


class Level:
    """Keeps the first point of every voxel; with more than `most` voxels double in size.

    Parameters
    ----------
    edge : m, of the voxels at first
    most : points that are held
    """

    def __init__(self, edge: float, most: int) -> None:
        self.edge = edge
        self._most = most
        self._voxels = VoxelSet()
        self._points: list[NDArray[np.float32]] = []
        self._times: list[NDArray[np.float64]] = []

    def add(self, points: NDArray[np.float64], times: NDArray[np.float64]) -> None:
        """Take points (N, 3), m, at times (N,), s."""
        self._keep(points.astype(np.float32), times)
        while len(self._voxels) > self._most:
            self.edge *= 2.0
            held = self.result
            self._voxels, self._points, self._times = VoxelSet(), [], []
            self._keep(held.points, held.times)

    def _keep(self, points: NDArray[np.float32], times: NDArray[np.float64]) -> None:
        new = self._voxels.add(voxel_keys(points.astype(np.float64), self.edge))
        self._points.append(points[new])
        self._times.append(times[new])

    @property
    def result(self) -> LevelPoints:
        """What is held."""
        if not self._points:
            return LevelPoints(self.edge, np.empty((0, 3), np.float32), np.empty(0))
        return LevelPoints(self.edge, np.concatenate(self._points), np.concatenate(self._times))


def coarser_levels(finest: LevelPoints, n: int) -> list[LevelPoints]:
    """Return `n` levels, each with voxels four times as large as the one before."""
    levels = [finest]
    for _ in range(n):
        level = Level(levels[-1].edge * COARSER, len(levels[-1].points) + 1)
        level.add(levels[-1].points.astype(np.float64), levels[-1].times)
        levels.append(level.result)
    return levels[1:]
