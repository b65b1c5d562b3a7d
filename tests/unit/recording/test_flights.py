# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which files are of one recording is told by their times and topics."""

import pytest

from bentwing.base.errors import RecordingError
from bentwing.recording.flights import flights_of


@pytest.fixture
def write(tmp_path, ros1):
    def make(name, start, stop, topics=("/scan", "/imu")):
        makers = {"/scan": ros1.scan, "/imu": ros1.imu}
        entries = [(topic, t, makers[topic](t)) for t in (start, stop) for topic in topics]
        return ros1.write(tmp_path / name, entries)

    return make


def test_files_that_follow_each_other_are_one_recording(write):
    second, first = write("b.bag", 60.4, 120.0), write("a.bag", 0.0, 60.2)
    assert flights_of([second, first]) == [[first, second]]


def test_files_that_begin_much_later_are_flights_of_their_own(write):
    first, second = write("a.bag", 0.0, 60.0), write("b.bag", 90.0, 120.0)
    assert flights_of([first, second]) == [[first], [second]]
    assert flights_of([second, first]) == [[second], [first]]


def test_the_same_topics_at_the_same_time_are_two_carriers(write):
    first, second = write("a.bag", 0.0, 60.0), write("b.bag", 0.0, 55.0)
    assert flights_of([first, second]) == [[first], [second]]


def test_other_topics_at_the_same_time_are_of_the_same_carrier(write):
    lidar, imu = write("a.bag", 0.0, 60.0, ("/scan",)), write("b.bag", 0.1, 60.0, ("/imu",))
    assert flights_of([lidar, imu]) == [[lidar, imu]]


def test_parts_of_two_flights_are_told_apart(write):
    files = [write(f"{k}.bag", 60.0 * k, 60.0 * k + 59.0) for k in (0, 1, 5, 6)]
    assert flights_of(files) == [files[:2], files[2:]]


def test_a_file_that_is_missing_is_named(tmp_path):
    with pytest.raises(RecordingError, match="no such file"):
        flights_of([tmp_path / "gone.bag", tmp_path / "other.bag"])
