# SPDX-License-Identifier: MIT OR Apache-2.0
"""How places are made, described, and believed to be the same; one default for all sensors."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PlaceSettings:
    """How places are made and described.

    Attributes
    ----------
    duration : s, of a place; short enough for the drift within it to be small
    tile : m, edge of the tiles of clouds without times, and the farthest a carrier goes within a
        place
    max_points : of a place; of more, every n-th is taken
    voxel : m, of the averaged cloud
    surfel : m, voxel of the surfels by which matches are verified
    n_keypoints : drawn per place
    """

    duration: float = 10.0
    tile: float = 30.0
    max_points: int = 200_000
    voxel: float = 0.3
    surfel: float = 0.5
    n_keypoints: int = 400


@dataclass(frozen=True, slots=True)
class MatchSettings:
    """What it takes to believe that two places overlap.

    Attributes
    ----------
    n_neighbours : of each descriptor that may vote
    min_votes : for a pair of places to become a candidate
    max_candidates : of each place, those with the most votes
    n_hypotheses : transforms of each candidate that get a quick look, those on which most matches agree
    n_refined : of these that are refined, those that look best
    min_inliers : keypoints in agreement
    min_overlap : share of the smaller place that the other one has too
    min_agreement : share of what both could see that both saw alike; 0.05 less without planes, as
        leaves look different from everywhere
    min_sure_agreement : the same where less than `wide_overlap` is shared, where it is not known of
        both what they saw through, and where no other match says the same; 0.05 more without planes
    wide_overlap : share of the smaller place from which the lesser agreement is enough
    max_conflict : share of what one place saw where the other saw through; tells apart what is built
        alike but furnished differently
    max_leafy_conflict : the same where there are no planes: leaves let some beams through
    max_distance : m, median across the planes of surfels near each other; the least of the checks
        to be fooled by places that are built alike, and the first to be widened for a poor sensor
    min_conditioning : least eigenvalue of the alignment's information, per surfel
    """

    n_neighbours: int = 5
    min_votes: float = 8.0
    max_candidates: int = 8
    n_hypotheses: int = 40
    n_refined: int = 6
    min_inliers: int = 4
    min_overlap: float = 0.25
    min_agreement: float = 0.7
    min_sure_agreement: float = 0.8
    wide_overlap: float = 0.35
    max_conflict: float = 0.006
    max_leafy_conflict: float = 0.03
    max_distance: float = 0.025
    min_conditioning: float = 0.01
