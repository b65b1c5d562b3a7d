# SPDX-License-Identifier: MIT OR Apache-2.0
"""Walls and things of a place, and what became of them."""

import numpy as np
import pytest

from bentwing.base.transform import upright
from bentwing.closing.places import describe_run
from bentwing.closing.places.things import _Planes, compare_things

from .conftest import SIZE, T_B_WORLD, hall, moved, seen


def beside_walls(points):
    """Distances (N,) from the nearest wall of the hall, m."""
    return np.minimum(points[:, :2], SIZE[:2] - points[:, :2]).min(axis=1)


def test_walls_are_what_goes_on_and_things_stand_away_from_them(places_a):
    planes = _Planes.of(places_a[0].surfels)
    assert len(planes.walls) > 400
    assert beside_walls(planes.walls.means).max() < 0.1
    assert len(planes.things) > 30
    assert beside_walls(planes.things.means).min() > 0.3
    low, high = hall(3)
    inside = [
        ((planes.things.means > lo - 0.1) & (planes.things.means < hi + 0.1)).all(axis=1)
        for lo, hi in zip(low[1:], high[1:], strict=True)
    ]
    assert np.any(inside, axis=0).all()  # each is on a box


@pytest.mark.parametrize(
    ("changed", "least", "most"), [(0, 0.9, 1.0), (4, 0.7, 0.9), (18, 0.0, 0.3)]
)
def test_the_share_of_things_that_are_where_they_were_falls_with_those_moved(
    places_a, changed, least, most
):
    later = describe_run(*moved(*seen(3, 1, changed=changed), T_B_WORLD))
    things = compare_things(places_a[0], later[0], np.linalg.inv(T_B_WORLD))
    assert least <= things.share_kept <= most
    assert things.share_pierced < 0.01


def test_in_a_wrong_place_beams_pass_through_walls(places_a, places_b):
    wrong = upright(0.0, np.array([3.0, 2.0, 0.0])) @ np.linalg.inv(T_B_WORLD)
    things = compare_things(places_a[0], places_b[0], wrong)
    assert things.share_pierced > 0.3


def test_where_nobody_knows_what_was_seen_through_nothing_is_pierced():
    scan = describe_run(seen(3, 0)[0])
    things = compare_things(scan[0], describe_run(seen(3, 1)[0])[0], np.eye(4))
    assert things.pierced == 0
    assert things.share_kept > 0.9


def test_a_floor_is_neither_wall_nor_thing():
    rng = np.random.default_rng(0)
    floor = describe_run(rng.uniform((0.0, 0.0, -0.01), (12.0, 9.0, 0.01), (60_000, 3)))
    things = compare_things(floor[0], floor[0], np.eye(4))
    assert (things.kept, things.moved, things.walls) == (0, 0, 0)
    assert things.share_kept == things.share_pierced == 0.0
