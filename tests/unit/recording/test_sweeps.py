# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

from collections import Counter

import numpy as np

from bentwing.recording.batches import LidarBatch
from bentwing.recording.sweeps import SweepMerger


def sweep(times):
    times = np.asarray(times, float)
    return LidarBatch(np.column_stack([times, times, times]), times)


def merged(sweeps):
    counts = Counter()
    merger = SweepMerger(counts)
    parts = [merger.push([part]) for part in sweeps] + [merger.finish()]
    times = np.concatenate([part.times for part in parts if part is not None])
    points = np.concatenate([part.points for part in parts if part is not None])
    np.testing.assert_array_equal(points[:, 0], times)
    return times, counts


def test_sweeps_that_overlap_are_merged_without_loss():
    starts = np.arange(0, 1, 0.1)
    times, counts = merged([sweep(start + np.linspace(0, 0.12, 50)) for start in starts])
    assert len(times) == 500
    assert np.all(np.diff(times) >= 0)
    assert counts["late_points"] == 0


def test_where_sweeps_overlap_only_the_order_of_equal_times_tells_them_apart():
    rng = np.random.default_rng(0)
    for _ in range(50):
        ends = np.cumsum(rng.uniform(0, 0.04, 4))
        times = [np.sort(rng.integers(0, 9, 30) * 0.01 + end) for end in ends]
        numbers = np.arange(120.0).reshape(4, 30)
        sweeps = [
            LidarBatch(np.column_stack([n, n, n]), t, n.astype(np.float32))
            for n, t in zip(numbers, times, strict=True)
        ]
        merger = SweepMerger(Counter())
        parts = [merger.push(sweeps), merger.finish()]
        points = np.concatenate([part.points for part in parts if part is not None])
        intensity = np.concatenate([part.intensity for part in parts if part is not None])
        np.testing.assert_array_equal(
            points[:, 0], np.argsort(np.concatenate(times), kind="stable")
        )
        np.testing.assert_array_equal(points[:, 0], intensity)


def test_points_before_what_was_handed_out_are_counted():
    times, counts = merged([sweep([0.0, 0.1]), sweep([0.2, 0.3]), sweep([0.0, 0.31, 0.4])])
    assert counts["late_points"] == 1
    np.testing.assert_array_equal(times, [0.0, 0.1, 0.2, 0.3, 0.31, 0.4])


def test_one_early_point_per_sweep_does_not_pile_up_memory():
    merger = SweepMerger(Counter())
    held = []
    for start in np.arange(0, 20, 0.1):
        merger.push([sweep([0.0, *(start + np.linspace(0, 0.1, 100))])])
        held.append(len(merger._held.times))
    assert max(held) < 600


def test_empty_sweeps_change_nothing():
    times, _ = merged([sweep([]), sweep([0.0, 0.1]), sweep([])])
    np.testing.assert_array_equal(times, [0.0, 0.1])
