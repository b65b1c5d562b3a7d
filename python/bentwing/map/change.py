# SPDX-License-Identifier: MIT OR Apache-2.0
"""What has changed since a map was made, as points and as areas."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from bentwing.base.voxels import unpack, voxel_keys

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Points nearer to each other than about this belong to one thing, m.
_TOGETHER = 0.3
# Seen from above an area is counted in squares of this edge, m, and is no thing if it is smaller than this, m².
_SQUARE, _SMALLEST = 0.1, 0.1

ChangeKind = Literal["appeared", "disappeared"]


@dataclass(frozen=True, slots=True)
class ChangedArea:
    """Points that have changed and lie together.

    Attributes
    ----------
    kind : of the change
    centre : (3,) m, mean of the points, frame of the trajectory
    low, high : m, heights it reaches from and to, there
    area : m², seen from above
    points : how many there are
    """

    kind: ChangeKind
    centre: tuple[float, float, float]
    low: float
    high: float
    area: float
    points: int


@dataclass(frozen=True, slots=True)
class Change:
    """What has changed.

    Attributes
    ----------
    appeared : (K, 3) m, frame of the trajectory, where the map was seen to be empty
    disappeared : (K, 3) m, points of the map that were seen through
    """

    appeared: NDArray[np.float64]
    disappeared: NDArray[np.float64]

    def areas(self) -> list[ChangedArea]:
        """Return the areas in which something has changed, the largest first; specks are none."""
        found = [*_areas("appeared", self.appeared), *_areas("disappeared", self.disappeared)]
        return sorted(found, key=lambda one: -one.area)


def _areas(kind: ChangeKind, points: NDArray[np.float64]) -> list[ChangedArea]:
    labels = _things(points)
    found = []
    for thing in range(labels.max(initial=-1) + 1):
        own = points[labels == thing]
        area = _SQUARE**2 * len(np.unique(np.floor(own[:, :2] / _SQUARE), axis=0))
        if area >= _SMALLEST:
            x, y, z = own.mean(axis=0).tolist()
            low, high = float(own[:, 2].min()), float(own[:, 2].max())
            found.append(ChangedArea(kind, (x, y, z), low, high, float(area), len(own)))
    return found


def _things(points: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return for each of points (N, 3) the number of the thing it belongs to."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    if not len(points):
        return np.empty(0, np.intp)
    keys, voxel = np.unique(voxel_keys(points, _TOGETHER), return_inverse=True)
    beside = cKDTree(unpack(keys)).query_pairs(1.8, output_type="ndarray")  # of a voxel's edges
    links = coo_matrix((np.ones(len(beside)), beside.T), shape=(len(keys), len(keys)))
    _, labels = connected_components(links, directed=False)
    return np.asarray(labels[voxel.ravel()], np.intp)
