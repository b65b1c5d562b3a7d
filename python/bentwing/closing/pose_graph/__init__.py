# SPDX-License-Identifier: MIT OR Apache-2.0
"""Poses of places and links between them in, the poses that agree best with the links out.

Links may be false: all but the trusted ones are weighed against each other, and those that disagree
are rejected and named. A dense trajectory then follows the poses without steps.
"""

from __future__ import annotations

from bentwing.closing.pose_graph.deform import deform_trajectory
from bentwing.closing.pose_graph.g2o import G2oGraph, read_g2o, write_g2o
from bentwing.closing.pose_graph.graph import (
    MAP,
    GravityTerms,
    Links,
    PoseGraph,
    nearest_semidefinite,
)
from bentwing.closing.pose_graph.solve import (
    RobustSettings,
    Solution,
    SolveSettings,
    solve_pose_graph,
)

__all__ = [
    "MAP",
    "G2oGraph",
    "GravityTerms",
    "Links",
    "PoseGraph",
    "RobustSettings",
    "Solution",
    "SolveSettings",
    "deform_trajectory",
    "nearest_semidefinite",
    "read_g2o",
    "solve_pose_graph",
    "write_g2o",
]
