# SPDX-License-Identifier: MIT OR Apache-2.0
"""Areas in which something has changed."""

import numpy as np
import pytest

from bentwing.map.change import Change

NOTHING = np.empty((0, 3))


def crate(corner, size, n=4000, seed=0):
    """Points all through a box."""
    rng = np.random.default_rng(seed)
    return np.array(corner) + rng.uniform(0.0, 1.0, (n, 3)) * size


def test_things_apart_are_areas_of_their_own_the_largest_first():
    small, large = crate([0, 0, 0], [0.5, 0.4, 1.0]), crate([2, 0, 0.5], [1.0, 0.8, 0.7])
    gone = crate([5, 5, 0], [0.6, 0.6, 0.4])
    areas = Change(np.concatenate([small, large]), gone).areas()
    assert [one.kind for one in areas] == ["appeared", "disappeared", "appeared"]
    assert areas[0].centre == pytest.approx((2.5, 0.4, 0.85), abs=0.03)
    assert (areas[0].low, areas[0].high) == pytest.approx((0.5, 1.2), abs=0.01)
    # squares of 0.1 m that are cut by the edges count as a whole
    assert areas[0].area == pytest.approx(0.8, abs=0.1)
    assert [one.points for one in areas] == [4000, 4000, 4000]


def test_specks_are_no_areas_and_nothing_has_none():
    speck = crate([0, 0, 0], [0.1, 0.1, 0.1], n=20)
    assert Change(speck, NOTHING).areas() == []
    assert Change(NOTHING, NOTHING).areas() == []
