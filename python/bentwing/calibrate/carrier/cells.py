# SPDX-License-Identifier: MIT OR Apache-2.0
"""Cells that are occupied in view after view while all around them changes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.voxels import centres_of, unpack
from bentwing.calibrate.carrier.view import EDGE, NEAR

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.calibrate.carrier.view import View

# Of the views in which something was seen in the direction of a cell, the share in which the cell was
# hit: by that it is the carrier's, and by that it may belong to a cell that is.
CERTAIN, LIKELY = 0.85, 0.5
MIN_OBSERVED = 5  # views
# What goes on beyond is no carrier but the ground or a wall at a constant distance; surfaces are seen
# in lines whose distance grows with the range.
REACH, END = 1.5, 1.8  # m
LINK, LINK_SHARE = 0.15, 0.25  # m, and of the range


def carrier_cells(views: Sequence[View]) -> list[NDArray[np.int64]]:
    """Return the keys of the cells of each part of the carrier.

    Parameters
    ----------
    views : between which the surroundings have changed
    """
    keys, shares = _occupancy(views)
    keys, shares = keys[shares >= LIKELY], shares[shares >= LIKELY]
    centres = centres_of(unpack(keys), EDGE)
    ranges = np.linalg.norm(centres, axis=1)
    is_seed = (shares >= CERTAIN) & (ranges < REACH)
    if not is_seed.any():
        return []
    labels = _connected(centres, ranges)
    parts = []
    for label in np.unique(labels[is_seed]):
        part = labels == label
        if ranges[part].max() < END:
            parts.append(keys[part])
    return parts


def _occupancy(views: Sequence[View]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return keys (N,) of near cells, and the share of views in which they were hit."""
    sets = [np.unique(view.cells) for view in views]
    keys, first, counts = np.unique(
        np.concatenate([view.cells for view in views]), return_index=True, return_counts=True
    )
    # That of a beam that hit the cell: few beams go through the middle of it.
    directions = np.concatenate([view.towards for view in views])[first]
    # A cell that is hit in few views cannot be occupied in most of those in which it is looked at.
    enough = counts >= LIKELY * MIN_OBSERVED
    keys, directions = keys[enough], directions[enough]
    n_hit, n_observed = np.zeros(len(keys)), np.zeros(len(keys))
    for view, cells in zip(views, sets, strict=True):
        hit = np.isin(keys, cells, assume_unique=True)
        n_hit += hit
        n_observed += hit | view.sees_along(directions)
    return keys, np.where(n_observed >= MIN_OBSERVED, n_hit / np.maximum(n_observed, 1.0), 0.0)


def _connected(centres: NDArray[np.float64], ranges: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return the number of the part (N,) to which each cell belongs."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(centres).query_pairs(LINK + LINK_SHARE * NEAR, output_type="ndarray")
    first, second = pairs.T
    apart = np.linalg.norm(centres[first] - centres[second], axis=1)
    linked = apart < LINK + LINK_SHARE * np.minimum(ranges[first], ranges[second])
    n = len(centres)
    graph = coo_matrix((np.ones(int(linked.sum())), (first[linked], second[linked])), shape=(n, n))
    _, labels = connected_components(graph, directed=False)
    return np.asarray(labels)
