# SPDX-License-Identifier: MIT OR Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from bentwing.base.transform import apply, inverse
from bentwing.closing.places import Agreement, MatchSettings, describe_run, match_places
from bentwing.closing.places.things import Things

from .conftest import T_B_WORLD, moved, seen

ANOTHER_DAY = MatchSettings(max_changed=0.05)


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


def test_a_hall_in_which_a_few_things_were_moved_is_the_same_to_who_names_it(places_a):
    later = describe_run(*moved(*seen(3, 1, changed=4), T_B_WORLD))
    (of_one_day,) = match_places(places_a, later)
    assert "saw through" in of_one_day.reason
    (found,) = match_places(places_a, later, settings=ANOTHER_DAY)
    assert found.accepted, found.reason
    assert found.agreement.things.moved > 10
    corners = np.array([[0.0, 0.0, 0.0], [18.0, 13.0, 5.0]])
    there = apply(found.alignment.T_a_b, apply(T_B_WORLD, corners))
    np.testing.assert_allclose(there, corners, atol=0.03)


def test_a_hall_of_the_same_walls_with_all_things_elsewhere_is_another_one(places_a):
    """However much may have changed: in the same hall most things would stand where they did."""
    other = describe_run(*moved(*seen(4, 1), T_B_WORLD))
    lenient = MatchSettings(max_changed=0.2)
    (found,) = match_places(places_a, other, settings=lenient)
    assert not found.accepted
    assert "faces of things" in found.reason
    things = found.agreement.things
    assert things.share_pierced < lenient.max_pierced  # the walls agree
    assert things.share_kept < 0.5 * lenient.min_kept


def test_what_was_moved_does_not_excuse_walls_that_cannot_be_there():
    settings = MatchSettings(max_changed=0.05)
    moved_things = Things(kept=60, moved=20, walls=500, pierced=0)
    changed = Agreement(0.6, 0.9, 0.03, 0.1, 400, 0.01, things=moved_things)
    assert changed.objection(settings) is None
    for worse, words in (
        (Things(kept=60, moved=20, walls=500, pierced=100), "100 of 500 on walls"),
        (Things(kept=20, moved=60, walls=500, pierced=0), "of 80 faces of things 20 are"),
        (Things(kept=5, moved=1, walls=500, pierced=0), "of 6 faces of things 5 are"),
        (None, "5.0% are allowed"),
    ):
        assert words in replace(changed, things=worse).objection(settings)
    assert "agreement is 0.75" in replace(changed, agreement=0.75).objection(settings)


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
