# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the positions of merged runs rest on."""

import pytest

from bentwing.evaluate.verdict import judge_joins, verdict_of
from bentwing.run.merging.joins import joins_of


@pytest.mark.parametrize(
    ("pairs", "unconfirmed"),
    [
        ([(0, 1)], [(0, 1)]),
        ([(0, 1), (1, 0)], []),  # two places
        ([(0, 1), (1, 2), (2, 0)], []),  # a loop of three runs
        ([(0, 1), (1, 2), (2, 0), (3, 2)], [(2, 3)]),
        ([(0, 1), (0, 1), (1, 2), (2, 3), (2, 3)], [(1, 2)]),  # two pairs hang by one place
        ([(0, 0), (0, 0), (0, 1)], [(0, 1)]),  # places within a run say nothing of the other
    ],
)
def test_a_place_is_confirmed_by_another_one_or_by_a_loop_of_runs(pairs, unconfirmed):
    found = joins_of(pairs)
    assert [(one.a, one.b) for one in found if not one.is_confirmed] == unconfirmed
    assert sum(one.n_places for one in found) == sum(a != b for a, b in pairs)


def test_names_stand_beside_the_numbers_of_places():
    (join,) = joins_of([(2, 0), (0, 2)])
    assert join.described(["a", "b", "c"]) == {"runs": ["a", "c"], "n_places": 2, "has_loop": False}


def test_a_single_place_that_nothing_confirms_is_doubtful():
    assert verdict_of(judge_joins([])).state == "good"
    found = verdict_of(judge_joins([("cellar", f"flat {k}") for k in range(5)]))
    assert found.state == "doubtful"
    assert (
        "flat 0 and cellar; flat 1 and cellar; flat 2 and cellar; and 2 more pairs"
        in found.sentence()
    )
