# SPDX-License-Identifier: MIT OR Apache-2.0
"""Scans whose `time_increment` is 0 get the times of their beams from the turn of the mirror."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from bentwing.recording.messages.laser_scan import points_of_scans
from bentwing.recording.messages.wire_scans import RawScan
from bentwing.recording.scan_times import find_scan_turn
from bentwing.recording.sweep_stamps import SweepStamps

NS = 1_000_000_000
PERIOD = 0.025
INCREMENT = np.radians(0.25)
BEAM = PERIOD * INCREMENT / (2 * np.pi)


def scan(*, n=1081, increment=INCREMENT, scan_time=0.0, time_increment=0.0):
    ranges = np.full(n, 5.0, np.float32)
    return RawScan(
        0, -0.5 * n * INCREMENT, increment, time_increment, scan_time, 0.1, 30.0, ranges, None
    )


def stamps(period=PERIOD, delay=0.03, reference=None, n=200):
    headers = [NS + round(k * period * NS) for k in range(n)]
    delays = delay + np.random.default_rng(0).exponential(0.001, n)
    arrivals = [h + round(d * NS) for h, d in zip(headers, delays, strict=True)]
    return SweepStamps.of(headers, arrivals, reference)


def beam_times(found, message):
    (batch,) = points_of_scans([message], np.array([10.0]), Counter(), reading=found)
    return batch.times


@pytest.mark.parametrize("increment", [INCREMENT, -INCREMENT])
def test_beams_follow_the_mirror_which_goes_on_behind_the_field(increment):
    message = scan(increment=increment)
    times = beam_times(find_scan_turn(message, stamps()), message)
    np.testing.assert_allclose(times, 10.0 + BEAM * np.arange(1081), atol=1e-6)


def test_the_scan_time_counts_where_only_every_second_scan_is_sent():
    found = find_scan_turn(scan(scan_time=PERIOD), stamps(2 * PERIOD))
    assert found.turn == pytest.approx(PERIOD)
    assert found.is_said


@pytest.mark.parametrize("scan_time", [0.0, 0.017, np.nan, -1.0, 40.0])
def test_a_scan_time_that_the_stamps_contradict_does_not_count(scan_time):
    found = find_scan_turn(scan(scan_time=scan_time), stamps())
    assert found.turn == pytest.approx(PERIOD, rel=1e-4)
    assert not found.is_said


def test_scans_that_arrive_too_soon_were_stamped_at_the_end():
    message = scan()
    found = find_scan_turn(message, stamps(delay=0.001))
    assert (found.reference, found.evidence) == ("end", "recorder")
    assert beam_times(found, message)[-1] == pytest.approx(10.0)
    assert found.first == pytest.approx(-1080 * BEAM, rel=1e-3)


def test_a_scan_with_times_of_its_own_keeps_them():
    message = scan(time_increment=3e-5)
    times = beam_times(find_scan_turn(scan(), stamps()), message)
    np.testing.assert_allclose(np.diff(times), 3e-5)


@pytest.mark.parametrize(
    ("message", "given", "reason"),
    [
        (scan(increment=0.0), stamps(), "angle from beam to beam"),
        (scan(), stamps(n=1), "too few"),
        (scan(), stamps(period=20.0), "too few"),
        (scan(n=4000), stamps(), "more than once"),
    ],
)
def test_scans_that_do_not_tell_get_no_times(message, given, reason):
    assert reason in find_scan_turn(message, given)
