# SPDX-License-Identifier: MIT OR Apache-2.0
"""How places are made, described, and believed to be the same; one default for all sensors."""

from __future__ import annotations

from pydantic import Field

from bentwing.base.settings import Settings
from bentwing.base.units import Metres, Seconds  # noqa: TC001 - pydantic reads them


class PlaceSettings(Settings):
    """How places are made and described."""

    duration: Seconds = Field(
        default=10.0,
        ge=0.1,
        le=3600,
        description="duration of a place, short enough for the drift within it to be small",
    )
    tile: Metres = Field(
        default=30.0,
        ge=0.1,
        le=1e6,
        description="edge of the tiles of clouds without times, and the farthest that a carrier goes "
        "within a place",
    )
    max_points: int = Field(
        default=200_000,
        ge=1,
        le=100_000_000,
        description="most points of a place; of more, every n-th is taken",
    )
    voxel: Metres = Field(default=0.3, ge=0.01, le=100, description="voxel of the averaged cloud")
    surfel: Metres = Field(
        default=0.5, ge=0.01, le=100, description="voxel of the surfels that verify matches"
    )
    n_keypoints: int = Field(
        default=400, ge=1, le=100_000, description="number of keypoints of a place"
    )


class MatchSettings(Settings):
    """What it takes to believe that two places overlap."""

    n_neighbours: int = Field(
        default=5, ge=1, le=1000, description="number of a descriptor's neighbours that vote"
    )
    min_votes: float = Field(
        default=8.0, ge=0, le=1e6, description="least votes that make two places a candidate"
    )
    max_candidates: int = Field(
        default=8,
        ge=1,
        le=1000,
        description="most candidates of a place, those with the most votes",
    )
    n_hypotheses: int = Field(
        default=40,
        ge=1,
        le=10_000,
        description="number of transforms per candidate that are checked quickly, those on which most "
        "matches agree",
    )
    n_refined: int = Field(
        default=6, ge=1, le=1000, description="number of these that are refined, the best ones"
    )
    min_inliers: int = Field(
        default=4, ge=1, le=10_000, description="least number of keypoints that agree"
    )
    min_overlap: float = Field(
        default=0.25,
        ge=0,
        le=1,
        description="least share of the smaller place that the other one has too",
    )
    min_agreement: float = Field(
        default=0.7,
        ge=0,
        le=1,
        description="least share, of what both could see, that both saw alike; 0.05 less without planes, "
        "because leaves differ from every side",
    )
    min_sure_agreement: float = Field(
        default=0.8,
        ge=0,
        le=1,
        description="the same where less than `wide_overlap` is shared, where it is unknown what beams of "
        "both passed through, and where no other match says the same; 0.05 more without planes",
    )
    wide_overlap: float = Field(
        default=0.35,
        ge=0,
        le=1,
        description="share of the smaller place from which `min_agreement` is enough",
    )
    max_conflict: float = Field(
        default=0.006,
        ge=0,
        le=1,
        description="largest share of what one place saw where beams of the other passed through; "
        "separates what is built alike but furnished differently",
    )
    max_leafy_conflict: float = Field(
        default=0.03,
        ge=0,
        le=1,
        description="the same without planes: leaves let some beams through",
    )
    max_changed: float = Field(
        default=0.0,
        ge=0,
        le=1,
        description="the same where things may have been moved in between: walls must stand, and most "
        "things; for who knows that it is the same site, as `localize` is told, and 0 tells rooms apart by "
        "little that stands elsewhere",
    )
    max_pierced: float = Field(
        default=0.05,
        ge=0,
        le=1,
        description="largest share of the walls that beams passed through where things were moved",
    )
    min_kept: float = Field(
        default=0.55,
        ge=0,
        le=1,
        description="least share of the faces of things that are where they were where some were moved",
    )
    max_distance: Metres = Field(
        default=0.025,
        gt=0,
        le=100,
        description="largest median distance across the planes of surfels near each other; of all checks "
        "the hardest to pass for places that are built alike, and the first to widen for a poor sensor",
    )
    min_conditioning: float = Field(
        default=0.01,
        ge=0,
        le=1,
        description="least eigenvalue of the alignment's information, per surfel",
    )
