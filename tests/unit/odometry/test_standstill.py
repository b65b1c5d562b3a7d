# SPDX-License-Identifier: MIT OR Apache-2.0
"""Stalls of a head, told while the samples come and never changed afterwards."""

import numpy as np
import pytest

from bentwing.odometry.continuous.standstill import SpinWatch
from bentwing.recording import EncoderBatch, ImuBatch


def turning(*stalls, seconds=40.0, usual=6.0):
    times = np.arange(0.0, seconds, 0.005)
    rate = np.full(len(times), usual)
    rate[times < 3.0] = 0.0
    for start, stop in stalls:
        rate[(times >= start) & (times < stop)] = 0.05
    return times, rate


def watched(times, rate, step=20):
    watch = SpinWatch(by_encoder=False)
    for k in range(0, len(times), step):
        gyro = np.outer(rate[k : k + step], [0.0, 0.6, 0.8])
        watch.add(ImuBatch(times[k : k + step], gyro, np.zeros_like(gyro)))
    return watch


def test_a_stall_is_found_with_its_start_and_its_end():
    (found,) = watched(*turning((20.0, 27.0))).stalls(39.0)
    assert found == pytest.approx((20.0, 27.0), abs=0.3)


def test_a_rest_before_the_first_turn_is_none():
    assert watched(*turning()).stalls(39.0) == []


def test_the_first_turn_is_when_the_head_has_been_once_around():
    times, rate = turning()  # 6 rad/s from 3 s on
    assert watched(times, rate).first_turn == pytest.approx(3.0 + 2 * np.pi / 6.0, abs=0.3)


def test_a_head_at_rest_with_a_biased_gyro_has_no_first_turn():
    times = np.arange(0.0, 200.0, 0.005)
    assert watched(times, np.full(len(times), 0.05)).first_turn is None


def test_a_stall_that_lasts_has_no_end_yet():
    watch = watched(*turning((20.0, 27.0)))
    assert watch.stalls(20.3) == []
    assert watch.stalls(24.0) == [(pytest.approx(20.0, abs=0.3), None)]


def test_what_is_said_of_a_time_does_not_depend_on_what_came_later():
    times, rate = turning((15.0, 18.0), (24.0, 26.5))
    whole = watched(times, rate)
    for until in np.arange(5.0, 38.0, 0.37):
        known = times < until + 0.1
        assert watched(times[known], rate[known], 7).stalls(until) == whole.stalls(until)


def test_a_pause_too_short_to_harm_is_none():
    assert watched(*turning((20.0, 20.3))).stalls(39.0) == []


def test_a_carrier_that_turns_slowly_is_no_head():
    assert watched(*turning((20.0, 27.0), usual=1.0)).stalls(39.0) == []


def test_an_encoder_tells_the_same():
    times, rate = turning((20.0, 27.0))
    watch = SpinWatch(by_encoder=True)
    angles = np.cumsum(rate) * 0.005
    for k in range(0, len(times), 20):
        watch.add(EncoderBatch(times[k : k + 20], angles[k : k + 20]))
    (found,) = watch.stalls(39.0)
    assert found == pytest.approx((20.0, 27.0), abs=0.3)
