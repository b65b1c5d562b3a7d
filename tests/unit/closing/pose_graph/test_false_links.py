# SPDX-License-Identifier: MIT OR Apache-2.0
"""Graphs with a known truth and a fifth of false links more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.closing.pose_graph import SolveSettings, solve_pose_graph
from bentwing.evaluate.alignment import position_error
from bentwing.simulate.pose_graphs import with_false_links, with_known_truth

TURN_SIGMA, SHIFT_SIGMA = 0.01, 0.05  # of the helix's links, rad and m, as their information says


@pytest.fixture
def noisy(helix):
    """The helix with Gaussian errors of its links, and poses that only the links in time give."""
    rng = np.random.default_rng(8)
    links = helix.links
    shifts = rng.normal(scale=SHIFT_SIGMA, size=(len(links), 3))
    turns = rng.normal(scale=TURN_SIGMA, size=(len(links), 3))
    links = replace(
        links,
        positions=links.positions + geometry.rotate(links.quats_xyzw, shifts),
        quats_xyzw=geometry.multiply(links.quats_xyzw, geometry.exp(turns)),
    )
    position, turn = helix.positions[0], helix.quats_xyzw[0]
    positions, quats = [position], [turn]
    for row in np.flatnonzero(links.trusted):
        position = position + geometry.rotate(turn, links.positions[row])
        turn = geometry.multiply(turn, links.quats_xyzw[row])
        positions.append(position)
        quats.append(turn)
    return replace(helix, positions=np.array(positions), quats_xyzw=np.array(quats), links=links)


@pytest.mark.parametrize("seed", range(6))
def test_a_fifth_of_false_links_is_rejected_and_changes_nothing(helix, noisy, seed):
    assert position_error(noisy.positions, helix.positions) > 10 * SHIFT_SIGMA
    clean = solve_pose_graph(noisy)
    assert not len(clean.rejected)
    assert position_error(clean.positions, helix.positions) < 2 * SHIFT_SIGMA
    false, n = with_false_links(noisy, 0.2, seed)
    solution = solve_pose_graph(false)
    assert solution.rejected.tolist() == list(range(len(noisy.links), len(noisy.links) + n))
    assert position_error(solution.positions, clean.positions) < 1e-6


def test_the_same_false_links_give_the_same_bytes(noisy):
    false, _ = with_false_links(noisy, 0.2, seed=1)
    first, second = solve_pose_graph(false), solve_pose_graph(false)
    assert first.positions.tobytes() == second.positions.tobytes()
    assert first.weights.tobytes() == second.weights.tobytes()


def test_a_graph_that_is_given_a_truth_has_errors_as_large_as_before(noisy):
    best = solve_pose_graph(noisy, SolveSettings(robust=None))
    known = with_known_truth(noisy, seed=2)
    np.testing.assert_array_equal(known.positions, best.positions)
    again = solve_pose_graph(replace(known, positions=noisy.positions, quats_xyzw=noisy.quats_xyzw))
    assert 0.1 * SHIFT_SIGMA < position_error(again.positions, best.positions) < 2 * SHIFT_SIGMA
    # At the truth the links are off by what they have been off from it.
    fixed = solve_pose_graph(
        replace(known, fixed=np.ones(len(known), np.bool_)), SolveSettings(robust=None)
    )
    np.testing.assert_allclose(fixed.cost, best.cost, rtol=0.02)
