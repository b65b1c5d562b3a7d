# SPDX-License-Identifier: MIT OR Apache-2.0
"""What has changed between a map and a recording that was registered with it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.voxels import VoxelSet, pack, unpack, voxel_keys
from bentwing.closing.places import FreeSpace, positions_at, seen_through
from bentwing.map.change import Change

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.map.chunk import MapChunk

# Two clouds are compared by voxels of this edge and their neighbours, m: nearer than one edge is unchanged,
# farther than two is changed.
_VOXEL = 0.15
# One point of the map stands for this much of it, m.
_SPACING = 0.1
# Points that are seen from about the same place: enough to tell what lies between, few enough for what
# moves away not to be in front of itself.
_LOOK = 50_000
# What fewer looks saw through may lie behind an edge.
_MIN_LOOKS = 4
# Beams of a look that are followed, and the voxels of what they pass, m: a voxel beside a surface is not known to
# be empty, so of larger ones the lower metre of a box would not have appeared.
_BEAMS, _LOOKED = 12_000, 0.25
# New points are kept this much apart, m, and changed ones believed with so many others within a radius, m.
_FINE = 0.05
_TOGETHER = 0.3
_COMPANIONS = 5
_AROUND = np.array([(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)])


class Filled:
    """Voxels that hold points, and those beside them."""

    def __init__(self) -> None:
        self._voxels = VoxelSet()

    def add(self, points: NDArray[np.float64]) -> None:
        """Add points (N, 3) m, map frame."""
        around = unpack(np.unique(voxel_keys(points, _VOXEL)))[:, None, :] + _AROUND
        self._voxels.add(pack(around.reshape(-1, 3)))

    def has(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether each of points (N, 3) is in or beside a voxel that holds points."""
        return self._voxels.contains(voxel_keys(points, _VOXEL))


class ReferenceCloud:
    """The map as points 0.1 m apart, where it has any, and where it is known to have none."""

    def __init__(self) -> None:
        self.filled = Filled()
        self._seen = VoxelSet()
        self._points: list[NDArray[np.float64]] = []
        self._looks: list[FreeSpace] = []

    def add(self, points: NDArray[np.float64], origins: NDArray[np.float64] | None) -> None:
        """Add points (N, 3) m, map frame, seen from `origins` (N, 3) m if that is known."""
        self._points.append(points[self._seen.add(voxel_keys(points, _SPACING))])
        self.filled.add(points)
        if origins is not None:
            self._looks += looks(points, origins)

    @property
    def points(self) -> NDArray[np.float64]:
        """One point (K, 3) m of each voxel of 0.1 m."""
        return np.concatenate(self._points) if self._points else np.empty((0, 3))

    def was_empty(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether each of points (N, 3) m, where the map has none, lies where it was seen to be empty.

        Where nobody knows what was seen, all of them do.
        """
        if not self._looks:
            return np.ones(len(points), dtype=np.bool_)
        n = np.zeros(len(points), dtype=np.int64)
        for look in self._looks:
            n += look.contains(points)
        empty: NDArray[np.bool_] = n >= _MIN_LOOKS
        return empty


def looks(points: NDArray[np.float64], origins: NDArray[np.float64]) -> list[FreeSpace]:
    """Tell what the beams from `origins` to `points`, (N, 3) m in order of time, went through."""
    n = max(1, round(len(points) / _LOOK))
    parts = zip(np.array_split(points, n), np.array_split(origins, n), strict=True)
    return [seen_through(p, o, voxel=_LOOKED, most_beams=_BEAMS) for p, o in parts if len(p)]


class Difference:
    """Watches the points of a recording, in the map's frame and in the order of time.

    What stands alone is not believed: mixed pixels at edges and other errors of the sensor are scattered,
    things are not.

    Attributes
    ----------
    n_points : seen
    n_beyond : of them those where the map has nothing and nobody knows whether there was
    change : once all has been seen: what has appeared, 0.05 m apart, and disappeared, 0.1 m apart
    """

    def __init__(self, cloud: ReferenceCloud, trajectory: Trajectory) -> None:
        self.n_points = 0
        self.n_beyond = 0
        self.change = Change(np.empty((0, 3)), np.empty((0, 3)))
        self._cloud = cloud
        self._trajectory = trajectory
        self._points = cloud.points
        self._n_looks = np.zeros(len(self._points), dtype=np.int64)
        self._filled = Filled()
        self._seen = VoxelSet()
        self._new: list[NDArray[np.float64]] = []

    def watch(self, chunks: Iterable[MapChunk]) -> Generator[MapChunk, None, None]:
        """Pass a stream of chunks on unchanged, comparing it with the map."""
        for chunk in chunks:
            self._compare(chunk.points, positions_at(self._trajectory, chunk.times))
            yield chunk
        gone = (self._n_looks >= _MIN_LOOKS) & ~self._filled.has(self._points)
        self.change = Change(
            _not_alone(np.concatenate([np.empty((0, 3)), *self._new])),
            _not_alone(self._points[gone]),
        )

    @property
    def record(self) -> dict[str, Any]:
        """What was found, for run.json."""
        return {
            "points": self.n_points,
            "points_beyond_map": self.n_beyond,
            "appeared": len(self.change.appeared),
            "disappeared": len(self.change.disappeared),
            "changed_areas": self.change.areas(),
        }

    def _compare(self, points: NDArray[np.float64], origins: NDArray[np.float64]) -> None:
        unknown = points[~self._cloud.filled.has(points)]
        new = unknown[self._cloud.was_empty(unknown)]
        self.n_points += len(points)
        self.n_beyond += len(unknown) - len(new)
        self._new.append(new[self._seen.add(voxel_keys(new, _FINE))])
        self._filled.add(points)
        for look in looks(points, origins):
            self._n_looks += look.contains(self._points)


def _not_alone(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return those of points (N, 3) that have some others around them."""
    from scipy.spatial import cKDTree

    if not len(points):
        return points
    tree = cKDTree(points)
    n = tree.query_ball_point(points, _TOGETHER, return_length=True)
    return points[np.asarray(n) > _COMPANIONS]
