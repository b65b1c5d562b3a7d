# SPDX-License-Identifier: MIT OR Apache-2.0
"""Five marks on a site grid, as a surveyor has them: one that is wrong by a decimetre is named."""

import numpy as np
import pytest

from bentwing.closing.georeference.control_points import ControlPoint, Plane
from bentwing.closing.georeference.marks import Marks
from bentwing.closing.georeference.placement import Placement, place
from bentwing.closing.georeference.snooping import contradictions

GRID = Placement(np.radians(30), np.array([4500.0, 5500.0, 120.0]), np.zeros(4))
# Places in the map, and the normal of the surface there: two floors and three walls of a hall.
PLACES = np.array([[0, 6, 1.5], [0, 0, 0], [-4, -1, 1], [1, -5, 1.2], [4, -1, 0]], float)
NORMALS = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
USES = ("control", "control", "control", "check", "check")
SEEN = 0.01  # m, by which a mark is seen beside its place


def marks_with(rng, *, wrong=None, by=(0.0, 0.0, 0.0), n=5, picked=True):
    targets = GRID.to_level(PLACES[:n])
    if wrong is not None:
        targets[wrong] += by
    seen = PLACES[:n] + rng.normal(0.0, SEEN, (n, 3))
    listed = [
        ControlPoint(f"M{i + 1}", target, 0.3, use, place if picked else None)
        for i, (target, place, use) in enumerate(zip(targets, seen, USES, strict=False))
    ]
    middles = PLACES[:n] + NORMALS[:n] * rng.normal(0.0, 0.002, (n, 1))
    planes = [
        Plane(middle, normal, 0.01, 500, 1.0)
        for middle, normal in zip(middles, NORMALS, strict=False)
    ]
    return Marks(listed, targets, [], planes)


def found_in(marks):
    def fit(numbers):
        return place(marks.seen(numbers), marks.surfaces(numbers)[0], GRID)[0]

    return contradictions(marks, fit)


@pytest.mark.parametrize("wrong", range(5))
def test_a_mark_that_is_wrong_by_a_decimetre_is_named_alone(wrong):
    named = 0
    for axis in range(3):
        for seed in range(100, 110):
            by = 0.1 * np.eye(3)[axis]
            found = found_in(marks_with(np.random.default_rng(seed), wrong=wrong, by=by))
            assert all(one.number == wrong and one.is_certain for one in found)
            named += len(found)
            assert all(one.off == pytest.approx(0.1, abs=0.05) for one in found)
    # Of 30: seen to a centimetre, a decimetre is ten standard deviations and less.
    assert named >= 29


def test_good_marks_are_hardly_ever_doubted():
    doubted = sum(bool(found_in(marks_with(np.random.default_rng(s)))) for s in range(100, 500))
    assert doubted <= 4


def test_of_three_marks_the_wrong_one_is_named_or_the_rivals_too():
    for seed in range(100, 110):
        marks = marks_with(np.random.default_rng(seed), n=3, wrong=1, by=(0.0, 0.0, 0.3))
        (one,) = found_in(marks)
        assert 1 in (one.number, *one.rivals)
        assert "M2" in one.record(marks)["marks"]


def test_of_two_marks_nobody_says_which_is_wrong():
    (one,) = found_in(marks_with(np.random.default_rng(100), n=2, wrong=1, by=(0.0, 0.3, 0.0)))
    assert not one.is_certain
    assert {one.number, *one.rivals} == {0, 1}
