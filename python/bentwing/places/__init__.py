# SPDX-License-Identifier: MIT OR Apache-2.0
"""Places of runs, recognized in each other without a guess where they lie.

A run is cut into places; each is described at keypoints; similar descriptors vote for pairs of
places; the pairs with votes are verified by their geometry. Whatever was considered is listed, with
the reason why it was believed or not.
"""

from __future__ import annotations

from bentwing.places.cut import cut_places, describe_parts, describe_run, positions_at
from bentwing.places.free_space import FreeSpace, seen_through
from bentwing.places.from_run import RunMap, map_of_run, places_of_cloud, places_of_run
from bentwing.places.link import PlaceLink, link_between
from bentwing.places.match import Candidate, match_places
from bentwing.places.metric import Metric, default_metric, learn_metric
from bentwing.places.part import Part
from bentwing.places.place import Place, make_place
from bentwing.places.refine import Alignment
from bentwing.places.settings import MatchSettings, PlaceSettings
from bentwing.places.stream import PartStream
from bentwing.places.verify import Agreement

__all__ = [
    "Agreement",
    "Alignment",
    "Candidate",
    "FreeSpace",
    "MatchSettings",
    "Metric",
    "Part",
    "PartStream",
    "Place",
    "PlaceLink",
    "PlaceSettings",
    "RunMap",
    "cut_places",
    "default_metric",
    "describe_parts",
    "describe_run",
    "learn_metric",
    "link_between",
    "make_place",
    "map_of_run",
    "match_places",
    "places_of_cloud",
    "places_of_run",
    "positions_at",
    "seen_through",
]
