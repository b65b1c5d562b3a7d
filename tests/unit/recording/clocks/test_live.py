# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from bentwing.recording.clocks.live import LiveClock
from support.host_stamps import NS, START_NS, host_stamps


def live(stamps_ns, size=1):
    """Return what a live clock makes of stamps (N,) ns that come `size` at a time, s."""
    stamps, clock = (stamps_ns - START_NS) / NS, LiveClock()
    parts = [clock.steadied(stamps[i : i + size]) for i in range(0, len(stamps), size)]
    return stamps, np.concatenate(parts)


def off(times, stamps):
    """Return the share of stamps that are more than two milliseconds from where most are."""
    errors = stamps - times
    return np.mean(np.abs(errors - np.median(errors)) > 2e-3)


@pytest.mark.parametrize("period", [0.005, 0.025, 0.1])
def test_a_bad_host_is_mostly_corrected_by_the_stamps_so_far(period):
    times, stamps_ns = host_stamps(
        np.random.default_rng(3),
        period,
        40.0,
        jitter=1.2e-3,
        late=0.03,
        latest=0.024,
        lost=0.003,
        drift=1e-4,
        gap=(13.0, 13.08),
    )
    stamps, found = live(stamps_ns)
    assert np.all(np.diff(found) >= 0)
    known = times > 8.0  # 64 messages of the slowest have come
    assert off(times[known], found[known]) < 0.25 * off(times[known], stamps[known])


@pytest.mark.parametrize("jitter", [0.0, 1e-4])
def test_good_stamps_stay_as_they_are_to_the_bit(jitter):
    _, stamps_ns = host_stamps(np.random.default_rng(4), 0.1, 30.0, jitter=jitter)
    stamps, found = live(stamps_ns)
    assert np.array_equal(found, stamps)


def test_batches_of_any_size_give_the_same():
    _, stamps_ns = host_stamps(np.random.default_rng(5), 0.005, 10.0, jitter=1e-3, lost=0.01)
    assert np.array_equal(live(stamps_ns, 1)[1], live(stamps_ns, 37)[1])


def test_the_future_changes_nothing():
    _, stamps_ns = host_stamps(np.random.default_rng(6), 0.01, 20.0, jitter=1e-3, lost=0.01)
    assert np.array_equal(live(stamps_ns)[1][:1000], live(stamps_ns[:1000])[1])
