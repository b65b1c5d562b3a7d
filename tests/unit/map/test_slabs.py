# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.map.slabs import HALO, Extent


def chunks(n=3000, seed=2):
    """Points of a hall of 20 m by 6 m by 3 m, in three chunks."""
    rng = np.random.default_rng(seed)
    return np.split(rng.uniform(0, 1, (n, 3)) * (20.0, 6.0, 3.0) - (7.0, 1.0, 0.0), 3)


def slabs_of(parts, most):
    extent = Extent()
    for points in parts:
        extent.add(points)
    return extent.slabs(most)


@pytest.mark.parametrize("most", [50, 700, 1500, 5000])
def test_every_point_belongs_to_one_group_and_each_group_is_small_enough(most):
    sizes = None
    slabs = slabs_of(chunks(), most)
    sizes = np.zeros(slabs.n_groups, int)
    for points in chunks():
        belongs = np.zeros(len(points), int)
        for part in slabs.parts(points):
            belongs[part.rows[part.own]] += 1
            sizes[part.number] += len(part.rows)
        assert (belongs == 1).all()
    # Each chunk may give a group one point more than its share.
    assert sizes.max() <= most + len(chunks())


def test_a_group_has_all_that_is_near_its_own_points():
    slabs = slabs_of(chunks(), 1500)
    assert slabs.axis == 0
    assert slabs.n_groups > 2
    for points in chunks():
        along = points[:, 0]
        for part in slabs.parts(points):
            own = along[part.rows[part.own]]
            near = (along > own.min() - HALO) & (along < own.max() + HALO)
            assert set(np.flatnonzero(near)) <= set(part.rows)


def test_few_points_are_one_group_with_nothing_around():
    slabs = slabs_of(chunks(), 5000)
    for points in chunks():
        (part,) = slabs.parts(points)
        assert part.own.all()


def test_nothing_is_one_empty_group():
    assert Extent().slabs(10).n_groups <= 1
