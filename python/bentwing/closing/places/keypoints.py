# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where a place is described: points drawn at random, but none in the middle of a plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.closing.places.cloud import surfels_from

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.spatial import cKDTree

_REACH = 1.0  # m, of the neighbourhood that gives normal and planarity
_NEIGHBOURS = 24  # of it at most
_MIN_NEIGHBOURS = 6
_MAX_PLANARITY = 0.9
_LEAST_SLANT = np.sin(np.radians(10.0))
_SEED = 2013


@dataclass(frozen=True, slots=True)
class Keypoints:
    """Points with an upright frame: z is up, x the horizontal part of the local normal.

    Attributes
    ----------
    points : (K, 3) m, map frame
    headings : (K,) rad, of the frames' x axes; a normal has two signs, and so has x
    shapes : (K, 2) planarity, and the normal's slant 0 … 1 (1 is horizontal)
    """

    points: NDArray[np.float64]
    headings: NDArray[np.float64]
    shapes: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.points)


def draw_keypoints(cloud: NDArray[np.float64], n: int) -> Keypoints:
    """Draw up to `n` keypoints from an averaged cloud (V, 3), always the same ones.

    References
    ----------
    Bosse and Zlot 2013; Kaul 2015, section 2.2.
    """
    from scipy.spatial import cKDTree

    order = np.random.default_rng(_SEED).permutation(len(cloud))
    tree = cKDTree(cloud)
    found: list[Keypoints] = []
    # most of an indoor cloud is planar: draw on until there are enough
    for first in range(0, len(order), 2 * n):
        found.append(frames_at(tree, cloud[order[first : first + 2 * n]]))
        if sum(map(len, found)) >= n:
            break
    return _joined(found, n)


def frames_at(tree: cKDTree, points: NDArray[np.float64]) -> Keypoints:
    """Those of `points` that can be keypoints of the cloud in `tree`, with their frames."""
    cloud = np.append(tree.data, np.zeros((1, 3)), axis=0)  # the last stands for no neighbour
    distances, indices = tree.query(points, k=_NEIGHBOURS, distance_upper_bound=_REACH)
    there = np.isfinite(distances)[:, :, None]
    counts = np.maximum(there.sum(axis=1), 1)
    near = cloud[indices]
    centred = np.where(there, near - (near * there).sum(axis=1, keepdims=True) / counts[:, None], 0)
    covariances = np.einsum("nki,nkj->nij", centred, centred) / counts[:, :, None]
    local = surfels_from(points, covariances)
    slant = np.hypot(local.normals[:, 0], local.normals[:, 1])
    good = (
        (counts[:, 0] >= _MIN_NEIGHBOURS)
        & (local.planarity <= _MAX_PLANARITY)
        & (slant >= _LEAST_SLANT)
    )
    headings = np.arctan2(local.normals[:, 1], local.normals[:, 0])
    shapes = np.column_stack([local.planarity, slant])
    return Keypoints(points[good], headings[good], shapes[good])


def _joined(parts: list[Keypoints], n: int) -> Keypoints:
    if not parts:
        return Keypoints(np.zeros((0, 3)), np.zeros(0), np.zeros((0, 2)))
    return Keypoints(
        np.concatenate([part.points for part in parts])[:n],
        np.concatenate([part.headings for part in parts])[:n],
        np.concatenate([part.shapes for part in parts])[:n],
    )
