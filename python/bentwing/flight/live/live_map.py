# SPDX-License-Identifier: MIT OR Apache-2.0
"""The map so far: one point per voxel, in bounded memory."""

from __future__ import annotations

from dataclasses import dataclass
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.log import get_logger
from bentwing.base.value import Value
from bentwing.base.voxels import VoxelSet, voxel_keys

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.odometry.buffer import BatchBuffer
    from bentwing.odometry.interface import Registered

_log = get_logger(__name__)

# More points than this from one window add nothing to a map of one point per voxel.
POINTS_PER_WINDOW = 200_000


@dataclass(frozen=True, slots=True, eq=False)
class MapUpdate(Value):
    """What has come to the map since it was asked for last.

    Attributes
    ----------
    points : (N, 3) float32, m, map frame
    replaces : whether they take the place of all points given before: the first time, after the
        rehearsal, and when the voxels were made larger
    """

    points: NDArray[np.float32]
    replaces: bool


class LiveMap:
    """Points of one pass, placed once with the first estimate of the pose they were taken at.

    Parameters
    ----------
    spacing : m, edge of the voxels that keep one point each
    max_points : more are never held: the voxels double instead
    threads : of the placing
    """

    def __init__(self, spacing: float, max_points: int, threads: int) -> None:
        self.spacing = spacing
        self._max_points = max_points
        self._threads = threads
        self._until = -np.inf
        self._lock = Lock()
        self._voxels = VoxelSet()
        self._parts: list[NDArray[np.float32]] = []
        self._n_given = 0  # parts
        self._given_anything = False

    def add(self, registered: Registered, buffer: BatchBuffer) -> None:
        """Place what a window has newly registered."""
        first = registered.samples.start + registered.globals.latency_at(registered.samples.start)
        stretch = buffer.lidar(max(self._until, first), registered.end)
        self._until = registered.end
        chosen = slice(None, None, -(-len(stretch.times) // POINTS_PER_WINDOW) or None)
        angles = stretch.angles
        points = registered.samples.place(
            np.ascontiguousarray(stretch.points[chosen]),
            np.ascontiguousarray(stretch.times[chosen]),
            None if angles is None else np.ascontiguousarray(angles[chosen]),
            registered.globals,
            threads=self._threads,
        )
        self._keep(registered.level(points))

    def points(self) -> NDArray[np.float32]:
        """Return all points (N, 3), m, map frame."""
        with self._lock:
            parts = [*self._parts]
        return _joined(parts)

    def update(self) -> MapUpdate:
        """Return the points that were not returned before."""
        with self._lock:
            parts, replaces = self._parts[self._n_given :], not self._given_anything
            self._n_given, self._given_anything = len(self._parts), True
        return MapUpdate(_joined(parts), replaces)

    def _keep(self, points: NDArray[np.float64]) -> None:
        kept = points[self._voxels.add(voxel_keys(points, self.spacing))].astype(np.float32)
        if len(kept):
            with self._lock:
                self._parts.append(kept)
        while len(self._voxels) > self._max_points:
            self._coarsen()

    def _coarsen(self) -> None:
        self.spacing *= 2.0
        _log.info("more than %d points: the map keeps one per %g m", self._max_points, self.spacing)
        self._voxels = VoxelSet()
        points = self.points()
        kept = points[self._voxels.add(voxel_keys(points.astype(np.float64), self.spacing))]
        with self._lock:
            self._parts, self._n_given, self._given_anything = [kept], 0, False


def _joined(parts: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    return np.concatenate(parts) if parts else np.empty((0, 3), dtype=np.float32)
