# SPDX-License-Identifier: MIT OR Apache-2.0
"""Runs are put together by their matches, and false matches are told."""

import numpy as np
import pytest

from bentwing.base.transform import apply
from bentwing.closing.joining.matches import Part, connected, consistent
from bentwing.closing.joining.placing import place_groups
from bentwing.run.merging.source import distinct_names


def placed(corridor, matches):
    return place_groups(corridor.trajectories, corridor.places, matches)


def off(corridor, group):
    """How far the second run is from where it belongs, m."""
    first, second = corridor.parts
    truth = apply(corridor.T_0_1, corridor.trajectories[second].positions)
    assert np.array_equal(group.trajectories[first].times, corridor.trajectories[first].times)
    return np.linalg.norm(group.trajectories[second].positions - truth, axis=1).max()


def test_runs_are_put_together_without_a_guess(corridor):
    (group,), matches = placed(corridor, [corridor.match(k, k) for k in range(3)])
    assert off(corridor, group) < 1e-3
    assert all(m.believed for m in matches)


def test_a_single_match_is_enough(corridor):
    (group,), _ = placed(corridor, [corridor.match(2, 2)])
    assert off(corridor, group) < 1e-3


def test_places_of_a_part_too_short_for_them_share_a_node(corridor):
    # As after a break: a few poses, and places whose middles all lie beyond them.
    second = corridor.parts[1]
    short = {**corridor.trajectories, second: corridor.trajectories[second][:4]}
    groups, matches = place_groups(short, corridor.places, [corridor.match(k, k) for k in range(3)])
    assert [len(t) for group in groups for t in group.trajectories.values()] == [1200, 4]
    assert len(matches) == 3


def test_runs_without_a_match_stay_apart(corridor):
    groups, _ = placed(corridor, [corridor.match(0, 0).rejected("for the test")])
    assert [list(g.trajectories) for g in groups] == [[p] for p in corridor.parts]
    for group in groups:
        for part, trajectory in group.trajectories.items():
            np.testing.assert_allclose(
                trajectory.positions, corridor.trajectories[part].positions, atol=1e-9
            )


def test_a_match_that_contradicts_the_others_is_rejected_with_the_number(corridor):
    given = [corridor.match(k, k) for k in range(4)] + [corridor.match(4, 1, (12.0, 3.0, 0.0))]
    judged = consistent(given)
    assert [m.believed for m in judged] == [True] * 4 + [False]
    assert "contradicts 4 of the 4 matches" in judged[-1].reason


def test_two_matches_that_contradict_each_other_are_both_rejected(corridor):
    judged = consistent([corridor.match(0, 0), corridor.match(3, 3, (0.0, 5.0, 0.0))])
    assert not any(m.believed for m in judged)
    assert "nothing shows which one is right" in judged[0].reason
    groups, _ = placed(corridor, judged)
    assert len(groups) == 2


def test_a_match_that_is_not_sure_needs_another_that_says_the_same(corridor):
    unsure = [corridor.match(k, k, agreement=0.75) for k in range(2)]
    assert all(m.believed for m in consistent(unsure))
    (judged,) = consistent(unsure[:1])
    assert not judged.believed
    assert "only match" in judged.reason
    contradicted = [unsure[0], corridor.match(3, 3, (0.0, 5.0, 0.0), agreement=0.75)]
    assert not any(m.believed for m in consistent(contradicted))


def test_the_graph_finds_a_false_match_by_itself(corridor):
    given = [corridor.match(k, k) for k in range(5)] + [corridor.match(5, 2, (4.0, 0.0, 0.0))]
    (group,), matches = placed(corridor, given)
    assert [m.believed for m in matches] == [True] * 5 + [False]
    assert "contradicts the other matches by" in matches[-1].reason
    assert off(corridor, group) < 0.01


def test_a_centimetre_between_matches_is_no_contradiction(corridor):
    shifts = [(0.0, 0.0, 0.0)] * 5 + [(0.01, 0.0, 0.0)]
    _, matches = placed(corridor, [corridor.match(k, k, s) for k, s in enumerate(shifts)])
    assert all(m.believed for m in matches)


def test_groups_are_what_matches_connect(corridor):
    a, b, c = Part(0, 0), Part(1, 0), Part(2, 0)
    assert connected([a, b, c], [corridor.match(0, 0)]) == [[a, b], [c]]


@pytest.mark.parametrize(
    ("given", "found"),
    [
        (["a", "b"], ["a", "b"]),
        (["run", "run", "run"], ["run", "run_2", "run_3"]),
        (["x", "x", "x_2"], ["x", "x_2", "x_2_2"]),
    ],
)
def test_names_are_distinct(given, found):
    assert distinct_names(given) == found
