# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fixes of several runs: each with its antenna, and each run said to lie where its fixes are or not."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from bentwing.closing.georeference.receivers import Receivers
from bentwing.closing.georeference.shares import shares_of
from bentwing.recording.fixes import Fixes

SIGMA = 0.02  # m


def fixes(n=300, rate=5.0):
    covariances = np.tile(SIGMA**2 * np.eye(3), (n, 1, 1))
    counts = Counter({"messages": n, "fixes": n})
    return Fixes(np.arange(n) / rate, np.tile([11.0, 47.0, 500.0], (n, 1)), covariances, counts)


def two_runs():
    first = Receivers.one(fixes(), (0.1, 0.0, 0.0), "morning")
    second = Receivers.one(fixes(200), (0.0, 0.2, 0.0), "noon")
    return Receivers.joined([first, second.during([(0.0, 100.0)], offset=70.0)])


def test_each_fix_keeps_its_antenna_and_its_run():
    both = two_runs()
    assert both.names == ("morning", "noon")
    assert both.fixes.counts["messages"] == 500
    assert (np.diff(both.fixes.times) > 0).all()
    assert both.fixes.times[300] == 70.0
    assert (both.runs == np.repeat([0, 1], [300, 200])).all()
    assert (both.lever_arms[both.runs == 1] == [0.0, 0.2, 0.0]).all()


def test_only_fixes_within_the_spans_remain():
    seen = two_runs().during([(10.0, 20.0), (80.0, 90.0)])
    assert len(seen.fixes.times) == 2 * 51
    assert np.bincount(seen.runs).tolist() == [51, 51]


@pytest.mark.parametrize(("off", "disagrees"), [(0.0, False), (0.04, False), (0.5, True)])
def test_a_run_disagrees_that_lies_farther_from_its_fixes_than_their_noise(off, disagrees):
    both = two_runs()
    gaps = SIGMA * np.random.default_rng(1).normal(size=(500, 3))
    gaps[both.runs == 1] += [0.0, off, 0.0]
    used = np.linalg.norm(gaps, axis=1) < 0.3
    morning, noon = shares_of(both, gaps, used)
    assert not morning.disagrees
    assert morning.used == 300
    assert noon.disagrees is disagrees
    assert noon.offset == pytest.approx([0.0, off, 0.0], abs=0.01)
    assert noon.used + noon.rejected == 200
    if disagrees:
        assert "noon lies 0.50 m from its GNSS fixes" in noon.sentence()
        assert "200 of its 200 fixes are not used" in noon.sentence()


def test_a_run_without_a_fix_says_nothing():
    lone = Receivers.joined(
        [Receivers.one(fixes(), (0, 0, 0), "a"), Receivers.one(fixes(0), (0, 0, 0), "b")]
    )
    _, bare = shares_of(lone, np.zeros((300, 3)), np.ones(300, np.bool_))
    assert (bare.used, bare.offset, bare.disagrees) == (0, None, False)
