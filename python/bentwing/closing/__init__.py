# SPDX-License-Identifier: MIT OR Apache-2.0
"""Corrections of a whole trajectory: places, pose graphs, registration, maps, control points."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.closing.georeference.names import GeoreferenceMode
    from bentwing.closing.georeference.settings import GeoreferenceSettings
    from bentwing.closing.places.cut import describe_run
    from bentwing.closing.places.from_run import places_of_cloud, places_of_run
    from bentwing.closing.places.match import Candidate, match_places
    from bentwing.closing.places.place import Place
    from bentwing.closing.places.settings import MatchSettings, PlaceSettings
    from bentwing.closing.pose_graph.deform import deform_trajectory
    from bentwing.closing.pose_graph.g2o import G2oGraph, read_g2o, write_g2o
    from bentwing.closing.pose_graph.graph import Links, PoseGraph
    from bentwing.closing.pose_graph.solve import (
        RobustSettings,
        Solution,
        SolveSettings,
        solve_pose_graph,
    )
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "closing.georeference.names": ["GeoreferenceMode"],
            "closing.georeference.settings": ["GeoreferenceSettings"],
            "closing.places.cut": ["describe_run"],
            "closing.places.from_run": ["places_of_cloud", "places_of_run"],
            "closing.places.match": ["Candidate", "match_places"],
            "closing.places.place": ["Place"],
            "closing.places.settings": ["MatchSettings", "PlaceSettings"],
            "closing.pose_graph.deform": ["deform_trajectory"],
            "closing.pose_graph.g2o": ["G2oGraph", "read_g2o", "write_g2o"],
            "closing.pose_graph.graph": ["Links", "PoseGraph"],
            "closing.pose_graph.solve": [
                "RobustSettings",
                "Solution",
                "SolveSettings",
                "solve_pose_graph",
            ],
        },
    )

__all__ = [
    "Candidate",
    "G2oGraph",
    "GeoreferenceMode",
    "GeoreferenceSettings",
    "Links",
    "MatchSettings",
    "Place",
    "PlaceSettings",
    "PoseGraph",
    "RobustSettings",
    "Solution",
    "SolveSettings",
    "deform_trajectory",
    "describe_run",
    "match_places",
    "places_of_cloud",
    "places_of_run",
    "read_g2o",
    "solve_pose_graph",
    "write_g2o",
]
