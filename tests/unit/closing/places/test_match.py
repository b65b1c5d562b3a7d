# SPDX-License-Identifier: MIT OR Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from bentwing.base.transform import apply, inverse
from bentwing.closing.places import Agreement, MatchSettings, describe_run, match_places

from .conftest import T_B_WORLD, moved, seen


def test_two_views_of_a_hall_find_each_other_whatever_their_headings(places_a, places_b):
    (found,) = match_places(places_a, places_b)
    assert found.accepted, found.reason
    corners = np.array([[0.0, 0.0, 0.0], [18.0, 13.0, 5.0]])
    np.testing.assert_allclose(
        apply(found.alignment.T_a_b, apply(T_B_WORLD, corners)), corners, atol=0.03
    )


def test_halls_of_the_same_size_with_other_things_in_them_are_kept_apart(places_a):
    other = describe_run(*seen(4, 1))
    candidates = match_places(places_a, other)
    assert len(candidates) == 1
    assert not candidates[0].accepted
    assert candidates[0].reason


def test_a_hall_in_which_half_of_the_things_stand_elsewhere_is_kept_apart(places_a):
    """As a car park of the same building on another day: most of it agrees."""
    other = describe_run(*moved(*seen(3, 1, changed=9), T_B_WORLD))
    (found,) = match_places(places_a, other)
    assert not found.accepted
    assert "saw through" in found.reason
    assert found.agreement.agreement > MatchSettings().min_agreement


def test_what_was_not_seen_through_must_agree_the_more():
    settings = MatchSettings()
    agreement = 0.5 * (settings.min_agreement + settings.min_sure_agreement)
    sighted = Agreement(0.5, agreement, 0.0, 0.1, 200, 0.01)
    assert sighted.objection(settings) is None
    assert "agreement" in replace(sighted, blind=True, conflict=np.nan).objection(settings)
    assert "agreement" in replace(sighted, overlap=0.3).objection(settings)


def test_leaves_may_let_beams_through_and_walls_may_not():
    settings = MatchSettings()
    conflict = 0.5 * (settings.max_conflict + settings.max_leafy_conflict)
    leaves = Agreement(0.5, 0.68, conflict, 0.1, 200, np.nan)
    assert leaves.objection(settings) is None
    walls = replace(leaves, agreement=0.9, distance=0.01)
    assert "saw through" in walls.objection(settings)


def test_points_without_times_are_matched_too(places_b):
    scan = describe_run(seen(3, 0)[0])
    assert scan[0].span is None
    assert scan[0].free is None
    (found,) = match_places(scan, places_b)
    assert found.accepted, found.reason
    other = describe_run(moved(*seen(3, 1), T_B_WORLD)[0])
    (found,) = match_places(scan, other)
    assert found.accepted, found.reason
    assert np.isnan(found.agreement.conflict)


def test_matching_is_the_same_every_time_and_in_both_directions(places_a, places_b):
    first, second = (match_places(places_a, places_b)[0].alignment for _ in range(2))
    assert first.T_a_b.tobytes() == second.T_a_b.tobytes()
    back = match_places(places_b, places_a)[0].alignment
    np.testing.assert_allclose(back.T_a_b @ first.T_a_b, np.eye(4), atol=0.03)
    np.testing.assert_allclose(inverse(first.T_a_b) @ first.T_a_b, np.eye(4), atol=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"min_votes": 1e6}, "votes"),
        ({"min_inliers": 1000}, "keypoints agree"),
        ({"min_overlap": 1.0}, "overlap"),
        ({"min_agreement": 1.0}, "agreement"),
        ({"max_distance": 1e-6}, "planes are"),
        ({"min_conditioning": 1.0}, "conditioning"),
        ({"max_conflict": 0.0}, "saw through"),
    ],
)
def test_every_check_names_itself_when_it_rejects(places_a, places_b, change, words):
    (candidate,) = match_places(places_a, places_b, settings=MatchSettings(**change))
    assert not candidate.accepted
    assert words in candidate.reason


def test_a_run_without_places_matches_nothing(places_a):
    assert match_places(places_a, []) == []
    assert match_places([], places_a) == []
