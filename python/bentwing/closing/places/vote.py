# SPDX-License-Identifier: MIT OR Apache-2.0
"""Similar descriptors vote for the pairs of places they come from."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.closing.places.gestalt import opposite

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.closing.places.metric import Metric
    from bentwing.closing.places.place import Place


def vote(
    ours: Sequence[Place], theirs: Sequence[Place], metric: Metric, n_neighbours: int
) -> NDArray[np.float64]:
    """Count votes (len(ours), len(theirs)) for pairs of places.

    Each descriptor of ours votes for the places of its nearest neighbours among all of theirs; a
    vote is worth 1 at no distance and 0 at the metric's reach and beyond.
    """
    from scipy.spatial import cKDTree

    votes = np.zeros((len(ours), len(theirs)))
    counts = [len(place.keypoints) for place in theirs]
    if not sum(counts):
        return votes
    places = np.append(np.repeat(np.arange(len(theirs)), counts), 0)
    tree = cKDTree(np.concatenate([metric.apply(place.descriptors) for place in theirs]))
    for i, place in enumerate(ours):
        for descriptors in (place.descriptors, opposite(place.descriptors)):
            distances, indices = tree.query(
                metric.apply(descriptors), k=n_neighbours, distance_upper_bound=metric.reach
            )
            worth = np.where(np.isfinite(distances), 1.0 - distances / metric.reach, 0.0)
            votes[i] += np.bincount(
                places[indices.ravel()], weights=worth.ravel(), minlength=len(theirs)
            )
    return votes


def likely_pairs(
    votes: NDArray[np.float64], min_votes: float, max_candidates: int
) -> NDArray[np.bool_]:
    """Pairs with enough votes that are among the best of either of their places."""
    rank_ours = (-votes).argsort(axis=1, kind="stable").argsort(axis=1, kind="stable")
    rank_theirs = (-votes).argsort(axis=0, kind="stable").argsort(axis=0, kind="stable")
    likely: NDArray[np.bool_] = (votes >= min_votes) & (
        np.minimum(rank_ours, rank_theirs) < max_candidates
    )
    return likely
