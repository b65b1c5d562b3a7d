# SPDX-License-Identifier: MIT OR Apache-2.0
"""False links for a pose graph, and the error of its positions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bentwing.evaluate.alignment import align
from bentwing.pose_graph import Links, PoseGraph


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


def position_error(positions: np.ndarray, truth: np.ndarray) -> float:
    """Root mean square distance after alignment, m."""
    alignment = align(positions, truth)
    errors = positions @ alignment.R.T + alignment.t - truth
    return float(np.sqrt((errors**2).sum(axis=1).mean()))
