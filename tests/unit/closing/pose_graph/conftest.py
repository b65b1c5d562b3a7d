# SPDX-License-Identifier: MIT OR Apache-2.0
"""A graph with a known truth, and false links for any graph."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.closing.pose_graph import Links, PoseGraph


@pytest.fixture
def helix():
    """Six turns with exact links in time and from turn to turn; the first node is fixed."""
    n, per_turn = 96, 16
    angles = 2 * np.pi * np.arange(n) / per_turn
    positions = np.stack([5 * np.cos(angles), 5 * np.sin(angles), 0.2 * angles], axis=1)
    quats = geometry.exp(np.stack([0 * angles, 0 * angles, angles], axis=1))
    pairs = [(i, i + 1) for i in range(n - 1)] + [(i, i + per_turn) for i in range(n - per_turn)]
    nodes = np.array(pairs)
    back = geometry.inverse(quats[nodes[:, 0]])
    links = Links(
        nodes,
        geometry.rotate(back, positions[nodes[:, 1]] - positions[nodes[:, 0]]),
        geometry.multiply(back, quats[nodes[:, 1]]),
        np.tile(np.diag([1e4, 1e4, 1e4, 400.0, 400.0, 400.0]), (len(nodes), 1, 1)),
        nodes[:, 1] - nodes[:, 0] == 1,
    )
    return PoseGraph(positions, quats, links, np.arange(n) == 0)


@pytest.fixture
def disturbed(helix):
    """The helix with poses that are wrong by decimetres and tenths of a radian."""
    rng = np.random.default_rng(3)
    free = ~helix.fixed[:, None]
    shifts = rng.normal(scale=0.3, size=(len(helix), 3)) * free
    turns = rng.normal(scale=0.2, size=(len(helix), 3)) * free
    quats = geometry.multiply(geometry.exp(turns), helix.quats_xyzw)
    return PoseGraph(helix.positions + shifts, quats, helix.links, helix.fixed)
