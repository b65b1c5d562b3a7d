# SPDX-License-Identifier: MIT OR Apache-2.0
"""Matches with an exact truth, of which some are false."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bentwing.base.transform import upright
from bentwing.closing.agreement import Sighting, agreements, largest_group

TRUE = (1.2, np.array([5.0, -3.0, 0.7]))
FALSE = (-0.4, np.array([20.0, 8.0, 0.0]))


def sighting(where=TRUE, *, at=0.0, shift=0.0, turn=0.0, drifts=True):
    """A match `at` seconds into both runs, which flew 0.5 m/s along x."""
    yaw, t = where
    T = upright(yaw + turn, t + np.array([0.0, shift, 0.0]))
    return Sighting(T, np.array([0.5 * at, 0.0, 1.0]), at if drifts else 0.0, at)


def test_what_is_true_agrees_and_what_is_false_is_left_out():
    given_matches = [sighting(at=10.0 * k) for k in range(4)] + [sighting(FALSE, at=15.0)]
    group = largest_group(given_matches)
    assert group.members.tolist() == [True] * 4 + [False]
    assert not group.contested


@given(st.permutations(range(7)))
def test_the_order_of_matches_does_not_matter(order):
    matches = [sighting(at=10.0 * k) for k in range(4)] + [sighting(FALSE, at=k) for k in range(3)]
    group = largest_group([matches[k] for k in order])
    assert group.members.tolist() == [k < 4 for k in order]


def test_false_matches_that_agree_with_each_other_win_only_if_they_are_more():
    true = [sighting(at=10.0 * k) for k in range(3)]
    false = [sighting(FALSE, at=10.0 * k) for k in range(3)]
    assert not largest_group(true + false[:2]).contested
    assert largest_group(true + false).contested
    assert largest_group(true[:2] + false).members.tolist() == [False] * 2 + [True] * 3


def test_two_that_contradict_each_other_contest_each_other():
    assert largest_group([sighting(), sighting(FALSE)]).contested


def test_one_alone_is_a_group_that_nothing_contests():
    group = largest_group([sighting()])
    assert group.members.tolist() == [True]
    assert not group.contested


def test_a_run_that_drifts_slowly_is_one_group_though_its_ends_are_far_apart():
    """Five millimetres a second of each run are allowed; here they drift by four."""
    drifted = [sighting(at=10.0 * k, shift=0.08 * k) for k in range(20)]
    group = largest_group(drifted)
    assert group.members.all()


def test_what_agrees_with_some_of_a_group_does_not_contest_it():
    """A chain of which neighbours agree and the ends do not."""
    chain = [sighting(shift=0.3 * k) for k in range(4)]
    group = largest_group(chain)
    assert group.members.sum() == 2
    assert not group.agree[0, 3]
    assert not group.contested


@pytest.mark.parametrize(
    ("elapsed", "shift", "turn", "agrees"),
    [
        (0.0, 0.39, 0.0, True),
        (0.0, 0.41, 0.0, False),
        (0.0, 0.0, np.radians(1.9), True),
        (0.0, 0.0, np.radians(2.1), False),
        (60.0, 0.9, 0.0, True),  # 0.4 m and twice 0.3 m
        (60.0, 1.1, 0.0, False),
    ],
)
def test_how_far_two_may_be_apart_grows_with_the_time_between_them(elapsed, shift, turn, agrees):
    pair = [sighting(), sighting(at=elapsed, shift=shift, turn=turn)]
    assert agreements(pair)[0, 1] == agrees


def test_a_map_that_does_not_drift_allows_for_one_run_only():
    shifts = {0.6: True, 0.8: False}
    for shift, agrees in shifts.items():
        pair = [sighting(drifts=False), sighting(at=60.0, shift=shift, drifts=False)]
        assert agreements(pair)[0, 1] == agrees


@given(st.lists(st.tuples(st.floats(0, 100), st.floats(-2, 2), st.floats(-0.1, 0.1)), min_size=1))
def test_agreement_is_mutual_and_a_group_agrees_in_all_pairs(values):
    group = largest_group([sighting(at=t, shift=s, turn=r) for t, s, r in values])
    assert np.array_equal(group.agree, group.agree.T)
    assert group.agree[np.ix_(group.members, group.members)].all()
