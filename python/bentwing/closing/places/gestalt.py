# SPDX-License-Identifier: MIT OR Apache-2.0
"""Gestalt descriptors: how heights are distributed around a keypoint."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.closing.places.keypoints import Keypoints

RADIUS = 5.0
"""m, of the neighbourhood, and how far above and below the keypoint it reaches."""
N_RINGS, N_SECTORS = 4, 8
_N_BINS = N_RINGS * N_SECTORS
SIZE = 3 * _N_BINS + 2
"""Mean and spread of the heights and share of the points in each bin, and two values of shape."""


def describe(cloud: NDArray[np.float64], keypoints: Keypoints) -> NDArray[np.float64]:
    """Gestalt descriptors (K, SIZE) of keypoints in their averaged cloud (V, 3).

    Heights are those above the keypoint; an empty bin has mean, spread and share 0. The other sign
    of the frame's x axis is `opposite`.

    References
    ----------
    Walthelm 2004; Bosse and Zlot 2013.
    """
    if not len(keypoints):
        return np.zeros((0, SIZE))
    owners, offsets = _neighbourhoods(cloud, keypoints.points)
    angle = np.arctan2(offsets[:, 1], offsets[:, 0]) - keypoints.headings[owners]
    sector = np.floor(angle / (2 * np.pi) * N_SECTORS).astype(np.int64) % N_SECTORS
    distance = np.hypot(offsets[:, 0], offsets[:, 1])
    ring = np.minimum((distance / RADIUS * N_RINGS).astype(np.int64), N_RINGS - 1)
    bins = (owners * N_RINGS + ring) * N_SECTORS + sector
    n = len(keypoints) * _N_BINS
    counts = np.bincount(bins, minlength=n)
    some = np.maximum(counts, 1)
    mean = np.bincount(bins, weights=offsets[:, 2], minlength=n) / some
    square = np.bincount(bins, weights=offsets[:, 2] ** 2, minlength=n) / some
    spread = np.sqrt(np.maximum(square - mean**2, 0.0))
    table = np.stack([mean, spread]).reshape(2, len(keypoints), _N_BINS)
    counts = counts.reshape(len(keypoints), _N_BINS)
    share = np.sqrt(counts / np.maximum(counts.sum(axis=1, keepdims=True), 1))
    return np.hstack([table[0], table[1], share, keypoints.shapes])


def opposite(descriptors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the descriptors, had the frames' x axes pointed the other way."""
    n = len(descriptors)
    binned = descriptors[:, : 3 * _N_BINS].reshape(n, 3 * N_RINGS, N_SECTORS)
    turned = np.roll(binned, N_SECTORS // 2, axis=2).reshape(n, 3 * _N_BINS)
    return np.hstack([turned, descriptors[:, 3 * _N_BINS :]])


def _neighbourhoods(
    cloud: NDArray[np.float64], centres: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Whose neighbour each found point is, and its offset from there."""
    from scipy.spatial import cKDTree

    found = cKDTree(centres[:, :2]).sparse_distance_matrix(
        cKDTree(cloud[:, :2]), RADIUS, output_type="ndarray"
    )
    order = np.lexsort((found["j"], found["i"]))  # sums do not depend on the trees' order
    owners, indices = found["i"][order], found["j"][order]
    offsets = cloud[indices] - centres[owners]
    # the keypoint itself is above no sector
    near = (np.abs(offsets[:, 2]) <= RADIUS) & (offsets[:, :2] != 0.0).any(axis=1)
    return owners[near], offsets[near]
