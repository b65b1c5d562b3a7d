# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recordings whose beams or points have no times, or times that the payload has to explain."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base.errors import PayloadError, RecordingError
from bentwing.recording import Payload, Recording
from support.recordings import NO_IMU, joined, read


def test_scans_that_tell_no_time_per_beam_are_refused_for_mapping_only(tmp_path, ros1):
    untold = {"time_increment": 0.0, "angle_increment": 0.0}
    entries = [("/scan", i / 40, ros1.scan(i / 40, **untold)) for i in range(4)]
    path = ros1.write(tmp_path / "a.bag", entries)
    with pytest.raises(RecordingError, match="no time per beam"):
        Recording(path, NO_IMU)
    with Recording(path, NO_IMU, strict=False) as recording:
        assert recording.point_times is None
        assert sum(len(batch.times) for batch in recording.batches()) == 400


def untimed_scans(messages, *, delay, n=100):
    return [
        ("/scan", i / 40 + delay + 1e-4 * (i % 3), messages.scan(i / 40, time_increment=0.0))
        for i in range(n)
    ]


@pytest.mark.parametrize(("delay", "begin"), [(0.03, 0.0), (0.001, -99 * 0.02 / (80 * np.pi))])
def test_scans_without_time_per_beam_get_it_from_the_turn_of_the_mirror(
    tmp_path, ros1, delay, begin
):
    path = ros1.write(tmp_path / "a.bag", untimed_scans(ros1, delay=delay))
    (lidar, _, _), recording = read(path, NO_IMU)
    times = joined(lidar, "times").reshape(-1, 100)
    np.testing.assert_allclose(np.ptp(times, axis=1), 99 * 0.02 / (80 * np.pi), rtol=1e-6)
    first = recording.start_ns / 1e9 - 1_700_000_000
    assert first + times[0, 0] == pytest.approx(begin, abs=1e-6)
    (said,) = [text for text in recording.warnings if "time per beam made" in text]
    assert recording.point_times in said


def test_the_payload_says_which_moment_of_a_scan_its_stamp_is(tmp_path, ros1):
    entries = [("/scan", i / 40 + 0.03, ros1.scan(i / 40, time_increment=1e-4)) for i in range(9)]
    path = ros1.write(tmp_path / "a.bag", entries)
    payload = Payload(imu=None, lidar={"time_reference": "end"})
    (lidar, _, _), recording = read(path, payload)
    assert recording.start_ns == 1_700_000_000 * 10**9 - 9_900_000
    assert joined(lidar, "times")[99] == pytest.approx(0.0099)
    with pytest.raises(PayloadError, match=r"lidar\.time_reference, .* count from the stamp"):
        Recording(path, Payload(imu=None, lidar={"time_reference": "absolute"}))
    with pytest.raises(PayloadError, match=r"lidar\.time_field, .* no time field"):
        Recording(path, Payload(imu=None, lidar={"time_field": "t"}))


def test_clouds_without_time_per_point_are_refused(tmp_path, ros1):
    table = np.ones(10, [("x", "f4"), ("y", "f4"), ("z", "f4")])
    path = ros1.write(tmp_path / "a.bag", [("/points", 0.0, ros1.cloud(0.0, table))])
    with pytest.raises(RecordingError, match="no time per point"):
        Recording(path)


def turning_table(*, name=None, first=0.0):
    """Return points of a lidar that turns clockwise in 0.1 s, and their times in ms."""
    share = np.linspace(0, 1, 1200, endpoint=False)
    dtype = [("x", "f4"), ("y", "f4"), ("z", "f4"), ("ring", "u2")]
    table = np.zeros(1200, dtype if name is None else [*dtype, (name, "f4")])
    table["x"], table["y"] = 4 * np.cos(2 * np.pi * share), -4 * np.sin(2 * np.pi * share)
    table["ring"] = np.arange(1200) % 4
    table["z"] = table["ring"] - 1.5
    if name is not None:
        table[name] = first + 100 * share
    return table


@pytest.mark.parametrize(("delay", "begin"), [(0.103, 0.0), (0.004, -0.1)])
def test_clouds_without_time_per_point_get_it_from_the_azimuth(tmp_path, ros, delay, begin):
    entries = [
        ("/points", i / 10 + delay + 1e-4 * (i % 3), ros.cloud(i / 10, turning_table()))
        for i in range(30)
    ]
    path = ros.write(tmp_path / ("a.bag" if ros.ros1 else "a"), entries)
    (lidar, _, _), recording = read(path, NO_IMU)
    times = joined(lidar, "times") + recording.start_ns / 1e9 - 1_700_000_000 - begin
    expected = np.arange(30)[:, None] / 10 + np.linspace(0, 0.1, 1200, endpoint=False)
    np.testing.assert_allclose(times, expected.ravel(), atol=3e-4)
    assert any("turns clockwise" in text for text in recording.warnings)


def named_clouds(tmp_path, messages, **field):
    entries = [
        ("/points", i / 10 + 0.2, messages.cloud(i / 10, turning_table(**field))) for i in range(9)
    ]
    return messages.write(tmp_path / "a.bag", entries)


@pytest.mark.parametrize(
    ("lidar", "first", "begin"),
    [
        ({"time_field": "dt"}, 0.0, 0.0),
        ({"time_field": "DT", "time_unit": "ms"}, 0.0, 0.0),
        ({"time_field": "dt", "time_reference": "start"}, 0.0, 0.0),
        ({"time_field": "dt", "time_reference": "start"}, -100.0, 0.0),
        ({"time_field": "dt", "time_reference": "middle"}, 0.0, -0.05),
        ({"time_field": "dt", "time_reference": "end"}, 0.0, -0.1),
        ({"time_field": "dt", "time_reference": "end"}, -100.0, -0.1),
        ({"time_field": "dt", "time_reference": "end"}, 5000.0, -0.1),
    ],
)
def test_the_payload_names_a_time_field_its_unit_and_what_it_counts_from(
    tmp_path, ros1, lidar, first, begin
):
    path = named_clouds(tmp_path, ros1, name="dt", first=first)
    (batches, _, _), recording = read(path, Payload(imu=None, lidar=lidar))
    times = joined(batches, "times") + recording.start_ns / 1e9 - 1_700_000_000 - begin
    expected = np.arange(9)[:, None] / 10 + np.linspace(0, 0.1, 1200, endpoint=False)
    np.testing.assert_allclose(times, expected.ravel(), atol=2e-4)


@pytest.mark.parametrize(
    ("lidar", "sentence"),
    [
        ({"time_field": "dtt"}, r"lidar\.time_field, but .* have the fields x, y, z, ring, dt"),
        (
            {"time_field": "dt", "time_unit": "ns"},
            r"lidar\.time_field and lidar\.time_unit, but .* none that varies as the times of a sweep",
        ),
    ],
)
def test_a_time_field_that_the_clouds_do_not_have_is_refused(tmp_path, ros1, lidar, sentence):
    path = named_clouds(tmp_path, ros1, name="dt")
    with pytest.raises(PayloadError, match=sentence):
        Recording(path, Payload(imu=None, lidar=lidar))
