# SPDX-License-Identifier: MIT OR Apache-2.0
"""Pose graphs with false links or with a known truth."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.closing.pose_graph import Links, PoseGraph, SolveSettings, solve_pose_graph

if TYPE_CHECKING:
    from numpy.typing import NDArray


def with_false_links(graph: PoseGraph, share: float, seed: int) -> tuple[PoseGraph, int]:
    """Add links between nodes drawn at random, each with what one of the loop links has measured.

    That is what a mistaken place looks like: the shift and turn are those of a true match, and only
    the nodes are wrong. `share` is of the number of loop links; returns their number as well.
    """
    rng = np.random.default_rng(seed)
    links, n_nodes = graph.links, len(graph)
    loops = np.flatnonzero(~links.trusted)
    n = round(share * len(loops))
    copied, starts = rng.choice(loops, n), rng.integers(n_nodes, size=n)
    ends = (starts + rng.integers(2, n_nodes - 1, size=n)) % n_nodes
    false = Links(
        np.vstack([links.nodes, np.stack([starts, ends], axis=1)]),
        np.vstack([links.positions, links.positions[copied]]),
        np.vstack([links.quats_xyzw, links.quats_xyzw[copied]]),
        np.concatenate([links.information, links.information[copied]]),
        np.append(links.trusted, np.zeros(n, np.bool_)),
    )
    return replace(graph, links=false), n


def with_known_truth(graph: PoseGraph, seed: int) -> PoseGraph:
    """Return a graph like this one whose poses are true.

    They are those of the lowest cost, and each link is off by as much as it is from these, to one side
    or the other by chance. That keeps what real links have: errors of very different size, and information that does not tell
    it (the wild bootstrap of Wu 1986, with Rademacher's signs).
    """
    links = graph.links
    best = solve_pose_graph(graph, SolveSettings(robust=None))
    start, end = links.nodes.T
    back = geometry.inverse(best.quats_xyzw[start])
    shifts = geometry.rotate(back, best.positions[end] - best.positions[start])
    turns = geometry.multiply(back, best.quats_xyzw[end])
    # What is measured, as seen from what is true.
    inverse = geometry.inverse(turns)
    off_turns = geometry.log(geometry.multiply(inverse, links.quats_xyzw))
    off_shifts = geometry.rotate(inverse, links.positions - shifts)
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(len(links), 1))
    measured = replace(
        links,
        positions=shifts + geometry.rotate(turns, signs * off_shifts),
        quats_xyzw=geometry.multiply(turns, geometry.exp(signs * off_turns)),
    )
    return replace(graph, positions=best.positions, quats_xyzw=best.quats_xyzw, links=measured)


def noisy_sphere_positions() -> NDArray[np.float64]:
    """Return the true positions (2200, 3), m, of the public graph sphere_bignoise.

    They go around a sphere of 100 m in laps of 50 nodes; of 50 laps the first three and the last three
    are left out.
    """
    nodes = np.arange(2200)
    down, around = (nodes + 150) * np.pi / 2500, 2 * np.pi * nodes / 50
    level = 100 * np.sin(down)
    return np.stack([level * np.cos(around), level * np.sin(around), 100 * np.cos(down)], axis=1)
