# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is made of a sensor's own stamps."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.recording.packets.clock import MAX_DRIFT, PacketClock, decide

S, HOUR = 10**9, 3600 * 10**9
EPOCH = 1_700_000_000 * S


def pairs(offset_ns, *, delays_ns=(0,), period_ns=None):
    stamps = [(i * S // 10, delay) for i, delay in enumerate(delays_ns)]
    sensor = [(EPOCH - offset_ns + t, t + delay) for t, delay in stamps]
    wrapped = [(s % period_ns if period_ns else s, t) for s, t in sensor]
    return [(s, EPOCH + t) for s, t in wrapped]


@pytest.mark.parametrize("period_ns", [None, HOUR])
@pytest.mark.parametrize(
    ("offset_ns", "is_alone", "origin"),
    [
        (3_000_000, True, "sensor"),
        (-400_000_000, True, "sensor"),
        (37 * S, True, "start"),
        (-1500 * S, True, "start"),
        (3_000_000, False, "computer"),
    ],
)
def test_the_origin_is_decided_by_the_difference_and_by_who_else_has_a_clock(
    period_ns, offset_ns, is_alone, origin
):
    reading = decide(pairs(offset_ns, period_ns=period_ns), period_ns, is_alone=is_alone)
    assert (reading.origin, reading.offset_ns) == (origin, offset_ns)


def test_the_fastest_packet_tells_the_difference():
    found = decide(pairs(5 * S, delays_ns=(900, 400, 100, 700)), None, is_alone=True)
    assert found.offset_ns == 5 * S + 100


def test_the_difference_is_the_same_across_the_top_of_the_hour():
    start = EPOCH // HOUR * HOUR + HOUR - S // 5
    offset_ns = 100 * S
    taken = [((start - offset_ns + t) % HOUR, start + t) for t in range(0, S, S // 10)]
    taken += [((start + t) % HOUR, start + offset_ns + t) for t in range(0, S, S // 10)]
    assert decide(taken, HOUR, is_alone=True).offset_ns == offset_ns


@pytest.mark.parametrize("offset_ns", [3_000_000, 1234 * S, -1700 * S])
def test_stamps_go_on_over_many_hours(offset_ns):
    reading = decide(pairs(offset_ns, period_ns=HOUR), HOUR, is_alone=True)
    clock = PacketClock(reading)
    times = EPOCH + np.arange(0, 4 * HOUR, 777 * S)
    stamps = [clock.stamp_ns(int(t - offset_ns) % HOUR, int(t)) for t in times]
    shift = -offset_ns if reading.origin == "sensor" else 0
    np.testing.assert_array_equal(stamps, times + shift)


def test_following_never_bends_time_by_more_than_crystals_differ():
    clock = PacketClock(decide(pairs(5 * S), None, is_alone=False))
    stamps, computers = [], []
    for i in range(3000):
        sensor = EPOCH - 5 * S + i * 10_000_000
        computer = sensor + 5 * S + (40_000_000 if i > 1000 else 0)
        clock.observe(sensor, computer)
        stamps.append(clock.stamp_ns(sensor, computer))
        computers.append(computer)
    steps = np.diff(stamps) / 10_000_000
    assert np.abs(steps - 1).max() < MAX_DRIFT * 1.001
    assert stamps[900] == computers[900]
    assert stamps[-1] > stamps[900] + 2099 * 10_000_000 + 1_500_000
