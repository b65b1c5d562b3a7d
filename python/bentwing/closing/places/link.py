# SPDX-License-Identifier: MIT OR Apache-2.0
"""Matches of places as links of a pose graph."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.transform import inverse

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.closing.places.refine import Alignment


@dataclass(frozen=True, slots=True)
class PlaceLink:
    """One row of `bentwing.closing.pose_graph.Links`.

    Attributes
    ----------
    position : (3,) m, of the node in b as seen from the node in a
    quat_xyzw : (4,) its rotation there
    information : (6, 6) of `Log(measured⁻¹ · actual)`, rotation first, frame of the node in b
    """

    position: NDArray[np.float64]
    quat_xyzw: NDArray[np.float64]
    information: NDArray[np.float64]


def link_between(
    T_a_node: NDArray[np.float64], T_b_node: NDArray[np.float64], alignment: Alignment
) -> PlaceLink:
    """Link a node of run a to one of run b.

    Parameters
    ----------
    T_a_node, T_b_node : (4, 4) poses of the nodes, each in its own run's map
    alignment : of two accepted places
    """
    T_a_other = alignment.T_a_b @ T_b_node
    T_node_other = inverse(T_a_node) @ T_a_other
    R, arm = T_a_other[:3, :3], T_a_other[:3, 3] - alignment.about
    # a perturbation ξ of the node in its own frame is a turn R ξr about `about`, and this shift
    change = np.zeros((6, 6))
    change[:3, :3] = change[3:, 3:] = R
    change[3:, :3] = _cross_matrix(arm) @ R
    information = alignment.INDEPENDENT * change.T @ alignment.information @ change
    return PlaceLink(
        T_node_other[:3, 3],
        geometry.from_matrices(T_node_other[:3, :3]),
        0.5 * (information + information.T),
    )


def _cross_matrix(v: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
