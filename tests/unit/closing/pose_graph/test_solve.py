# SPDX-License-Identifier: MIT OR Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.errors import SingularSystemError
from bentwing.closing.pose_graph import (
    MAP,
    GravityTerms,
    Links,
    PoseGraph,
    SolveSettings,
    solve_pose_graph,
)

PLAIN = SolveSettings(robust=None)


def with_link(links, nodes, position, quat, information, *, trusted=False):
    return Links(
        np.vstack([links.nodes, nodes]),
        np.vstack([links.positions, position]),
        np.vstack([links.quats_xyzw, quat]),
        np.concatenate([links.information, information[None]]),
        np.append(links.trusted, trusted),
    )


def test_exact_links_bring_disturbed_poses_back(helix, disturbed):
    solution = solve_pose_graph(disturbed)
    assert solution.converged
    assert solution.cost < 1e-9 < solution.initial_cost
    np.testing.assert_allclose(solution.positions, helix.positions, atol=1e-6)
    turns = geometry.multiply(geometry.inverse(helix.quats_xyzw), solution.quats_xyzw)
    assert np.abs(geometry.log(turns)).max() < 1e-7
    assert not len(solution.rejected)


def test_the_cost_is_that_of_the_logarithm_of_the_error_rotation_first(helix):
    link = with_link(
        helix.links, [0, 1], [0.1, 0.2, 0.3], [0, 0, 0, 1.0], np.diag([1.0, 2, 3, 4, 5, 6])
    )
    two = Links(*(getattr(link, name)[-1:].copy() for name in Links.__slots__))
    quats = np.array([[0, 0, 0, 1.0], geometry.exp(np.array([0, 0, np.pi / 2])).tolist()])
    graph = PoseGraph(np.array([[0, 0, 0.0], [0.1, 0.2, 1.3]]), quats, two, np.ones(2, bool))
    solution = solve_pose_graph(graph, PLAIN)
    # A turn of π/2 about z and a shift of 1 along it: Log = [0, 0, π/2, 0, 0, 1].
    assert solution.chi2[0] == pytest.approx(3 * (np.pi / 2) ** 2 + 6, rel=1e-12)
    assert solution.cost == pytest.approx(0.5 * solution.chi2[0], rel=1e-12)


def test_a_false_link_is_rejected_and_named_but_not_where_it_is_trusted(disturbed):
    false = with_link(
        disturbed.links, [3, 70], [0.0, 0, 0], [0, 0, 0, 1.0], disturbed.links.information[0]
    )
    graph = replace(disturbed, links=false)
    assert solve_pose_graph(graph).rejected.tolist() == [len(false) - 1]
    assert not len(solve_pose_graph(graph, PLAIN).rejected)
    trusting = replace(graph, links=replace(false, trusted=np.ones(len(false), bool)))
    assert not len(solve_pose_graph(trusting).rejected)


def test_a_prior_and_gravity_hold_the_graph_as_well_as_a_fixed_node(helix, disturbed):
    links = with_link(
        disturbed.links, [MAP, 5], helix.positions[5], helix.quats_xyzw[5], np.eye(6), trusted=True
    )
    up = np.array([0.0, 0.0, 1.0])
    nodes = np.arange(len(helix))
    ups = geometry.rotate(geometry.inverse(helix.quats_xyzw), up)
    gravity = GravityTerms(nodes, ups, np.full(len(helix), 100.0))
    graph = replace(disturbed, links=links, fixed=np.zeros(len(helix), bool), gravity=gravity)
    np.testing.assert_allclose(solve_pose_graph(graph).positions, helix.positions, atol=1e-5)


def test_the_same_graph_gives_the_same_bytes(disturbed):
    first, second = solve_pose_graph(disturbed), solve_pose_graph(disturbed)
    assert first.positions.tobytes() == second.positions.tobytes()
    assert first.quats_xyzw.tobytes() == second.quats_xyzw.tobytes()


def test_a_node_that_nothing_holds_is_named(disturbed):
    graph = replace(disturbed, fixed=np.zeros(len(disturbed), bool))
    with pytest.raises(SingularSystemError, match="node 0 has no way over links"):
        solve_pose_graph(graph)


def test_a_link_to_a_node_that_is_not_there_is_refused(disturbed):
    links = with_link(disturbed.links, [3, 96], [0.0, 0, 0], [0, 0, 0, 1.0], np.eye(6))
    with pytest.raises(ValueError, match="names node 96, but there are 96"):
        solve_pose_graph(replace(disturbed, links=links))


def test_an_indefinite_information_is_refused_with_its_row(helix):
    information = helix.links.information.copy()
    information[7, 0, 0] = -1.0
    with pytest.raises(ValueError, match=r"links\.information: matrix 7 is not"):
        replace(helix.links, information=information)


def test_values_that_are_not_finite_are_refused_by_name(disturbed):
    positions = disturbed.positions.copy()
    positions[4, 1] = np.nan
    with pytest.raises(ValueError, match="positions: row 4 is not finite"):
        solve_pose_graph(replace(disturbed, positions=positions))
