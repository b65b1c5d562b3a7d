# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

from collections import Counter

import pytest

from bentwing.base.errors import RecordingError
from bentwing.recording.stamps import StampMonitor

S = 1_000_000_000


def accepted(pairs, *, use_recorder_time=False):
    """Return the stamps taken (s) of (header, recorder) pairs in s, and the counts."""
    counts = Counter()
    monitor = StampMonitor("/imu", use_recorder_time=use_recorder_time, counts=counts)
    taken = [monitor.accept(round(h * S), round(r * S)) for h, r in pairs]
    return [stamp / S for stamp in taken if stamp is not None], counts, monitor


def test_increasing_stamps_are_taken_as_they_are():
    stamps, counts, _ = accepted([(i, i + 0.1) for i in range(5)])
    assert stamps == [0, 1, 2, 3, 4]
    assert not counts


def test_backwards_and_repeated_stamps_are_dropped_by_reason():
    stamps, counts, monitor = accepted([(5, 5), (4.9, 5.1), (5, 5.2), (5.3, 5.3)])
    assert stamps == [5, 5.3]
    assert counts == {"backwards_stamps": 1, "duplicate_stamps": 1}
    assert monitor.first_backwards_ns == 4.9 * S


@pytest.mark.parametrize("jump", [2, 8, 1000, -1000])
def test_one_damaged_stamp_costs_one_message(jump):
    pairs = [(i / 10 + (jump if i == 5 else 0), i / 10) for i in range(20)]
    stamps, counts, _ = accepted(pairs)
    assert len(stamps) == 19
    assert counts == {"stamp_jumps": 1}


def test_a_recorder_that_stalled_costs_one_message():
    pairs = [(i / 10, max(i / 10, 5.0) if i > 20 else i / 10) for i in range(100)]
    stamps, _, _ = accepted(pairs)
    assert len(stamps) >= 99


def test_a_clock_that_was_set_is_refused():
    with pytest.raises(RecordingError, match=r"step by \+1000\.\d s against the recorder"):
        accepted([(i / 10 + (1000 if i > 5 else 0), i / 10) for i in range(100)])


def test_a_pause_of_the_recording_is_a_gap_and_no_jump():
    times = [*(i / 10 for i in range(10)), *(40 + i / 10 for i in range(10))]
    stamps, counts, monitor = accepted([(t, t) for t in times])
    assert stamps == times
    assert not counts
    ((start_ns, end_ns),) = monitor.gaps
    assert (start_ns, end_ns) == (0.9 * S, 40 * S)


def test_a_slow_stream_has_no_gaps():
    assert accepted([(i, i) for i in range(20)])[2].gaps == []


def test_the_recorders_time_replaces_missing_stamps():
    assert accepted([(0, 3), (0, 4)], use_recorder_time=True)[0] == [3, 4]
