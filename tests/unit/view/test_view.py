# SPDX-License-Identifier: MIT OR Apache-2.0
import sys

import numpy as np
import pytest

from bentwing.errors import UsageError
from bentwing.view import view_run
from bentwing.view.levels import Level, coarser_levels


def box(n, seed=0):
    """Points on the floor and two walls of a box of 6 m by 4 m by 3 m, and their times."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0.0, 1.0, (n, 3)) * [6.0, 4.0, 3.0]
    points[np.arange(n), rng.integers(0, 3, n)] = 0.0
    return points, np.linspace(0.0, 9.0, n)


def test_a_level_keeps_one_point_per_voxel_and_never_too_many():
    level = Level(0.1, most=1000)
    points, times = box(60_000)
    for part in np.array_split(np.arange(len(points)), 7):
        level.add(points[part], times[part])
    held = level.result
    assert 200 < len(held.points) <= 1000
    assert held.edge > 0.1
    cells = np.floor(held.points.astype(float) / held.edge)
    assert len(np.unique(cells, axis=0)) == len(cells)
    assert (np.diff(held.times) >= 0).all()
    # nothing is lost: every point has one that stands for it
    kept = {tuple(c) for c in cells.astype(int)}
    rounded = points.astype(np.float32).astype(float)
    assert {tuple(c) for c in np.floor(rounded / held.edge).astype(int)} == kept


def test_coarser_levels_are_much_smaller():
    level = Level(0.05, most=10**6)
    level.add(*box(50_000))
    levels = coarser_levels(level.result, 2)
    sizes = [len(level.result.points), *(len(coarse.points) for coarse in levels)]
    assert sizes[0] > 5 * sizes[1] > 25 * sizes[2] > 0
    assert levels[1].edge == pytest.approx(16 * 0.05)


def test_an_empty_level_is_no_error():
    empty = Level(0.1, most=10).result
    assert len(empty.points) == 0
    assert [len(level.points) for level in coarser_levels(empty, 1)] == [0]


def test_without_rerun_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(UsageError, match=r"bentwing\[view\]"):
        view_run(tmp_path)


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    with pytest.raises(UsageError, match=r"run\.json"):
        view_run(tmp_path)
