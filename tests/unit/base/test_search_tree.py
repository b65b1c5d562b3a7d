# SPDX-License-Identifier: MIT OR Apache-2.0
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

import bentwing
from bentwing.base.search_tree import nearest, within


@pytest.mark.parametrize("n", [0, 1, 9_999, 10_000, 25_001])
def test_parts_find_what_the_whole_finds(n):
    rng = np.random.default_rng(n)
    tree, points = cKDTree(rng.uniform(0, 9, (2000, 3))), rng.uniform(0, 9, (n, 3))
    distances, indices = nearest(tree, points, [1, 3], 0.5)
    expected = tree.query(points, k=[1, 3], distance_upper_bound=0.5)
    np.testing.assert_array_equal(distances, expected[0])
    np.testing.assert_array_equal(indices, expected[1])
    assert list(within(tree, points, 0.3)) == list(
        tree.query_ball_point(points, 0.3, return_sorted=True)
    )


def test_nobody_asks_the_tree_for_threads_of_its_own():
    for path in Path(bentwing.__file__).parent.rglob("*.py"):
        assert not re.search(r"query\w*\([^)]*\bworkers\s*=", path.read_text(encoding="utf-8")), (
            path
        )
