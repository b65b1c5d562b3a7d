# SPDX-License-Identifier: MIT OR Apache-2.0
"""Loops that a user has named, in a hall that was flown through twice with much drift between."""

from dataclasses import replace

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.errors import InputError
from bentwing.base.trajectory import Trajectory
from bentwing.base.transform import apply, from_poses, inverse, upright
from bentwing.closing.joining.matches import Part
from bentwing.closing.joining.named_loops import denied_by, judge_loops, outcomes, without_denied
from bentwing.closing.joining.placing import place_groups
from bentwing.closing.loop_file import NamedLoop, read_loops
from bentwing.closing.places import describe_run

from .conftest import moved, seen

DRIFT = upright(0.3, np.array([3.0, 2.0, 0.4]))
PART = Part(0, 0)


def passes(drift=DRIFT, other=3):
    """Trajectory and places of a flight through the hall, and again 10 s later, then `drift` off."""
    first, second = seen(3, 0), moved(*seen(other, 1), drift)
    parts = [first[2], second[2]]
    places = [describe_run(*first)[0], describe_run(*second)[0]]
    trajectory = Trajectory(
        np.concatenate([parts[0].times[:-1], parts[1].times + 10.0]),
        np.concatenate([parts[0].positions[:-1], parts[1].positions]),
        np.concatenate([parts[0].quats_xyzw[:-1], _turned(parts[1].quats_xyzw, drift)]),
    )
    spans = [(0.0, 10.0), (10.01, 20.0)]
    return {PART: trajectory}, {
        PART: [replace(p, span=s) for p, s in zip(places, spans, strict=True)]
    }


def _turned(quats, T):
    turn = geometry.from_matrices(T[:3, :3][None])
    return geometry.multiply(np.broadcast_to(turn, quats.shape), quats)


@pytest.fixture(scope="module")
def drifted():
    return passes()


def judged(flown, **loop):
    trajectories, places = flown
    (named,) = judge_loops([NamedLoop(**loop)], trajectories, places)
    return named


def true_transform(trajectories, first, second, drift=DRIFT):
    """Pose at the second time as seen from that at the first."""
    T = from_poses(*trajectories[PART].interpolate(np.array([first, second])))
    return inverse(T[0]) @ inverse(drift) @ T[1]


def as_transform(T):
    return {
        "translation": T[:3, 3].tolist(),
        "quaternion": geometry.from_matrices(T[:3, :3][None])[0].tolist(),
    }


def test_two_times_in_one_place_are_aligned_by_what_was_seen(drifted):
    named = judged(drifted, times=(3.0, 17.0))
    assert named.is_used, named.said
    corners = np.array([[0.0, 0.0, 0.0], [18.0, 13.0, 5.0]])
    found = apply(named.match.alignment.T_a_b, apply(DRIFT, corners))
    np.testing.assert_allclose(found, corners, atol=0.03)


def test_the_way_bends_until_a_named_loop_is_met_however_little_it_was_expected_to(drifted):
    """Four metres in 10 s are hundreds of standard deviations of the trusted way between."""
    trajectories, places = drifted
    named = judged(drifted, times=(3.0, 17.0))
    groups, _ = place_groups(trajectories, places, [named.match])
    told, warnings = outcomes([named], trajectories, groups[0].trajectories)
    before, after = told[0]["off"]
    assert before > 3.0
    assert after < 0.02
    assert told[0]["kept"]
    assert warnings == []


def test_a_loop_that_the_result_leaves_is_told_and_warned_of(drifted):
    trajectories, _ = drifted
    told, warnings = outcomes([judged(drifted, times=(3, 17))], trajectories, trajectories)
    assert not told[0]["kept"]
    assert "3 s and 17 s" in warnings[0]
    assert "contradicts it" in warnings[0]


def test_a_rough_transform_is_made_exact_by_what_was_seen(drifted):
    T = true_transform(drifted[0], 3.0, 17.0) @ upright(0.05, np.array([0.2, -0.15, 0.1]))
    named = judged(drifted, times=(3.0, 17.0), transform=as_transform(T))
    assert named.is_used, named.said
    corners = np.array([[0.0, 0.0, 0.0], [18.0, 13.0, 5.0]])
    found = apply(named.match.alignment.T_a_b, apply(DRIFT, corners))
    np.testing.assert_allclose(found, corners, atol=0.03)


def test_a_transform_that_what_was_seen_contradicts_is_refused_with_the_reason(drifted):
    T = true_transform(drifted[0], 3.0, 17.0) @ upright(1.0, np.array([4.0, 2.0, 0.0]))
    named = judged(drifted, times=(3.0, 17.0), transform=as_transform(T))
    assert not named.is_used
    told, warnings = outcomes([named], *[drifted[0]] * 2)
    assert told[0]["said"].startswith("not used: ")
    assert warnings


def test_a_transform_between_what_nobody_saw_together_is_taken_as_given(drifted):
    trajectories, places = drifted
    cut = {PART: [places[PART][0], _beyond(places[PART][1])]}
    (named,) = judge_loops(
        [NamedLoop(times=(3.0, 17.0), transform=as_transform(upright(0.4, np.zeros(3))))],
        trajectories,
        cut,
    )
    assert named.is_used
    assert "taken as given" in named.said


def _beyond(place):
    """The same place with all that it saw 60 m away, and nothing known of free space."""
    surfels = replace(place.surfels, means=place.surfels.means + np.array([60.0, 0.0, 0.0]))
    return replace(place, surfels=surfels, free=None)


def test_places_that_differ_are_not_linked_because_somebody_says_so():
    named = judged(passes(other=4), times=(3.0, 17.0))
    assert not named.is_used
    assert named.said.startswith("not used: ")


@pytest.mark.parametrize(
    ("times", "said"), [((3.0, 8.0), "in one stretch"), ((3.0, 99.0), "nothing was seen at 99 s")]
)
def test_times_that_make_no_loop_are_refused(drifted, times, said):
    assert said in judged(drifted, times=times).said


def test_what_is_denied_is_kept_apart_and_the_finished_map_may_not_join_it(drifted):
    trajectories, places = drifted
    denied = judged(drifted, times=(3.0, 17.0), same=False)
    assert denied.said == "kept apart"
    assert denied_by([denied], trajectories, trajectories) is None
    groups, _ = place_groups(trajectories, places, [judged(drifted, times=(3.0, 17.0)).match])
    assert "which the loops named deny" in denied_by([denied], trajectories, groups[0].trajectories)


def test_a_match_of_denied_places_is_rejected(drifted):
    match = replace(judged(drifted, times=(3.0, 17.0)).match, is_named=False)
    (after,) = without_denied([match], [judged(drifted, times=(3.0, 17.0), same=False)])
    assert after.reason == "named as not the same place"


def test_one_cannot_deny_what_both_times_plainly_see():
    named = judged(passes(drift=np.eye(4)), times=(3.0, 17.0), same=False)
    assert named.said.startswith("not used: ")
    assert "is alike" in named.said


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("loops: []", "at least 1"),
        ("times: [1, 2]", "unknown key 'times'"),
        ("loops: [{times: [5.0, 5.0]}]", "are one"),
        ("loops: [{times: [5.0]}]", "times"),
        ("loops: [{times: [-1.0, 5.0]}]", "greater than or equal to 0"),
        (
            "loops: [{times: [1, 5], same: false, transform: {translation: [1, 0, 0]}}]",
            "not the same",
        ),
        ("loops: [{times: [1, 5], transform: {from_tf: {imu: a, lidar: b}}}]", "from_tf"),
        ("loops: [{times: [1, 5], sane: false}]", "did you mean 'same'"),
    ],
)
def test_a_file_that_names_no_loops_is_refused_with_what_is_wrong(tmp_path, text, said):
    (tmp_path / "loops.yaml").write_text(text)
    with pytest.raises(InputError, match=r"loops\.yaml") as refused:
        read_loops(tmp_path / "loops.yaml")
    assert said in str(refused.value)


def test_rotations_have_the_forms_of_the_payload(tmp_path):
    path = tmp_path / "loops.yaml"
    path.write_text(
        "loops:\n- times: [2, 23]\n- {times: [4, 9], same: false}\n"
        "- {times: [1, 30], transform: {translation: [1, 2, 0], rpy_deg: [0, 0, 90]}}\n"
    )
    plain, denied, given = read_loops(path)
    assert plain.T_first_second is None
    assert not denied.same
    assert given.T_first_second == pytest.approx(upright(np.pi / 2, np.array([1.0, 2.0, 0.0])))
