# SPDX-License-Identifier: MIT OR Apache-2.0
"""The part of a recording from which the set-up of its head is found."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.calibrate.set_up import edits
from bentwing.calibrate.set_up.stretch import BEFORE_MOTION, LENGTH, read_stretch
from bentwing.recording import Payload, Recording

PAYLOAD = Payload(T_imu_lidar={})
FIRST, SECOND = 10.0, 40.0  # s, of two motions of 8 s


@pytest.fixture
def recorded(tmp_path, ros1):
    """Return a maker of a recording of a head that moves twice, and rests in between."""

    def make(*gaps):
        path = ros1.write(tmp_path / "a.bag", entries(ros1, gaps))
        return Recording([path], PAYLOAD, strict=False)

    return make


def entries(ros1, gaps):
    """Messages in the order of their times, but for those in gaps, s."""
    entries = []
    for t in np.arange(0.0, 60.0, 0.02):
        moves = FIRST <= t < FIRST + 8 or SECOND <= t < SECOND + 8
        entries.append(("/imu", t, ros1.imu(t, [0.0, 0.5 * moves * np.sin(5 * t), 0.0])))
    entries += [("/scan", t, ros1.scan(t)) for t in np.arange(0.0, 60.0, 0.1)]
    kept = (e for e in entries if not any(start < e[1] < stop for start, stop in gaps))
    return sorted(kept, key=lambda entry: entry[1])


@pytest.fixture
def recording(recorded):
    with recorded() as opened:
        yield opened


def test_it_begins_shortly_before_the_first_motion(recording):
    times = read_stretch(recording).imu.times
    assert times[0] == pytest.approx(FIRST - BEFORE_MOTION, abs=0.3)
    assert times[-1] - times[0] == pytest.approx(LENGTH, abs=0.3)


def test_what_the_user_leaves_out_is_not_looked_at(recording):
    assert read_stretch(recording, 30.0).imu.times[0] == pytest.approx(
        SECOND - BEFORE_MOTION, abs=0.3
    )
    assert read_stretch(recording, SECOND - 1.0).imu.times[0] >= SECOND - 1.0


def test_another_offset_of_the_imus_clock_moves_its_samples(recording):
    stretch = read_stretch(recording)
    later = stretch.read_as(edits.with_imu(PAYLOAD, clock_offset=2.0))
    np.testing.assert_allclose(later.imu.times, stretch.imu.times + 2.0)
    np.testing.assert_array_equal(later.lidar.times, stretch.lidar.times)
    # The offset is that of the recording, not one more.
    again = later.read_as(edits.with_imu(PAYLOAD, clock_offset=2.0))
    np.testing.assert_array_equal(again.imu.times, later.imu.times)


@pytest.mark.parametrize(
    ("gaps", "start", "stop"),
    [
        ([(20.0, 21.0)], FIRST - BEFORE_MOTION, 20.0),
        ([(10.0, 11.5)], 11.5, 11.5 - BEFORE_MOTION + LENGTH),
        ([(10.0, 11.0), (24.0, 25.0)], 11.0, 24.0),
        ([(14.0, 14.2)], FIRST - BEFORE_MOTION, FIRST - BEFORE_MOTION + LENGTH),
    ],
)
def test_it_is_the_part_before_a_gap_or_the_longest_between_gaps(recorded, gaps, start, stop):
    with recorded(*gaps) as recording:
        stretch = read_stretch(recording)
    for times in (stretch.lidar.times, stretch.imu.times):
        assert times[0] == pytest.approx(start, abs=0.3)
        assert times[-1] == pytest.approx(stop, abs=0.3)
