# SPDX-License-Identifier: MIT OR Apache-2.0
import tracemalloc

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bentwing.base.voxels import (
    VoxelSet,
    by_key,
    cells_of,
    centres_of,
    column_keys,
    pack,
    unpack,
    voxel_keys,
)

BOUND = 2**20
cells = arrays(
    np.int64, st.tuples(st.integers(0, 20), st.just(3)), elements=st.integers(-BOUND, BOUND - 1)
)


@given(cells)
def test_a_cell_comes_back_from_its_key(given_cells):
    assert np.array_equal(unpack(pack(given_cells)), given_cells)


@given(cells)
def test_keys_are_in_the_order_of_the_cells(given_cells):
    order = np.argsort(pack(given_cells), kind="stable")
    expected = sorted(range(len(given_cells)), key=lambda i: tuple(given_cells[i]))
    assert order.tolist() == expected


@given(cells, st.integers(-3, 3))
def test_keys_repeat_beyond_the_bounds_and_leave_the_other_axes_alone(given_cells, times):
    moved = given_cells + np.array([0, times * 2 * BOUND, 0])
    assert np.array_equal(pack(moved), pack(given_cells))


@given(cells, st.floats(1e-3, 1e3))
def test_the_centre_of_a_voxel_is_in_it(given_cells, edge):
    assert np.array_equal(cells_of(centres_of(given_cells, edge), edge), given_cells)


@given(st.floats(-100, 100), st.floats(0.01, 10))
def test_voxels_are_as_large_below_zero_as_above_it(x, edge):
    (cell,) = cells_of(np.full((1, 3), x), edge)[:, 0]
    assert cell <= x / edge < cell + 1


def test_points_on_both_sides_of_zero_are_in_different_voxels():
    assert len(np.unique(voxel_keys(np.array([[-0.1] * 3, [0.1] * 3]), 1.0))) == 2


def test_points_above_each_other_are_in_one_column():
    points = np.array([[-0.1, 0.2, -7.0], [-0.9, 0.9, 5.0], [0.1, 0.2, 5.0]])
    first, second, third = column_keys(points, 1.0)
    assert first == second != third


@given(st.lists(st.integers(0, 5)))
def test_rows_of_equal_keys_are_brought_together_in_their_order(values):
    keys = np.array(values, dtype=np.int64)
    order, starts = by_key(keys)
    groups = np.split(order, starts[1:]) if len(keys) else []
    assert [group.tolist() for group in groups] == [
        np.flatnonzero(keys == key).tolist() for key in np.unique(keys)
    ]


NEAR_AND_FAR = st.one_of(
    st.integers(0, 5), st.integers(-(2**63), 2**63 - 1), st.integers(0, 5).map(lambda i: i << 42)
)


@given(st.lists(st.tuples(NEAR_AND_FAR, st.integers(0, 3))))
def test_rows_of_equal_keys_are_in_the_order_of_their_times(rows):
    keys = np.array([key for key, _ in rows], np.int64)
    times = np.array([float(time) for _, time in rows])
    assert np.array_equal(by_key(keys)[0], np.argsort(keys, kind="stable"))
    order, starts = by_key(keys, times)
    assert np.array_equal(order, np.lexsort((times, keys)))
    assert np.array_equal(keys[order[starts]], np.unique(keys))


def test_the_set_agrees_with_a_set_of_python():
    rng, reference, ours = np.random.default_rng(1), set(), VoxelSet()
    for _ in range(200):
        keys = rng.integers(0, 5000, rng.integers(0, 200))
        expected = []
        for key in keys.tolist():
            expected.append(key not in reference)
            reference.add(key)
        assert ours.add(keys).tolist() == expected
    assert len(ours) == len(reference)


def test_a_million_voxels_cost_a_few_bytes_each():
    ours, n = VoxelSet(), 1_000_000
    tracemalloc.start()
    for start in range(0, n, 100_000):
        ours.add(np.arange(start, start + 100_000) * 7919)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # 50 million voxels at this rate stay below 2 GB
    assert peak < 40 * n
