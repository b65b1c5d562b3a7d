# SPDX-License-Identifier: MIT OR Apache-2.0
"""Places of runs, recognized in each other without a guess of their relative poses.

A run is cut into places; each is described at keypoints; similar descriptors vote for pairs of
places; the pairs with votes are verified by their geometry. Whatever was considered is listed, with
the reason why it was believed or not.
"""

from __future__ import annotations

from bentwing.closing.places.cut import cut_places, describe_parts, describe_run, positions_at
from bentwing.closing.places.free_space import FreeSpace, seen_through
from bentwing.closing.places.from_run import RunMap, map_of_run, places_of_cloud, places_of_run
from bentwing.closing.places.link import PlaceLink, link_between
from bentwing.closing.places.match import Candidate, match_pair, match_places, verified
from bentwing.closing.places.metric import Metric, default_metric, learn_metric
from bentwing.closing.places.part import Part
from bentwing.closing.places.place import Place, make_place
from bentwing.closing.places.refine import Alignment
from bentwing.closing.places.settings import MatchSettings, PlaceSettings
from bentwing.closing.places.stream import PartStream, describe_stream
from bentwing.closing.places.verify import Agreement

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
    "describe_stream",
    "learn_metric",
    "link_between",
    "make_place",
    "map_of_run",
    "match_pair",
    "match_places",
    "places_of_cloud",
    "places_of_run",
    "positions_at",
    "seen_through",
    "verified",
]
