# SPDX-License-Identifier: MIT OR Apache-2.0
"""Clocks that are set, or begin again, while they are recorded."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.recording import LidarBatch, Recording
from bentwing.recording.clock_steps import CONFIRMED, ClockSteps
from support.lvx2 import PACKAGE_NS, Package, write_lvx2
from support.recordings import HEAD, NO_IMU, joined, read

S = 1_000_000_000


@pytest.mark.parametrize("step", [1000.0, -1000.0])
def test_a_clock_set_while_recording_goes_on_by_the_recorders_times(tmp_path, ros1, step):
    stamps = [i / 10 + (step if i > 10 else 0) for i in range(100)]
    entries = [("/scan", i / 10, ros1.scan(stamp)) for i, stamp in enumerate(stamps)]
    (lidar, _, _), recording = read(ros1.write(tmp_path / "a.bag", entries), NO_IMU)
    starts = joined(lidar, "times")[::100]
    np.testing.assert_allclose(starts, np.arange(100) / 10, atol=1e-6)
    (warning,) = recording.warnings
    assert f"by {step:+.1f} s at 1.1 s" in warning


def two_sessions(ros, path):
    """A device of lidar and IMU that starts again after 4 s and a pause of 20 s, its clock at zero.

    The recorder gets clouds 30 ms late and inertial samples 1 ms.
    """
    entries = []
    for begin, zero in [(0.0, 0.0), (24.0, 24.0 + 1.6e9)]:
        ticks = begin + np.arange(400) / 100
        entries += [("/imu", t + 0.001, ros.imu(t - zero)) for t in ticks.tolist()]
        for i in range(40):
            t = begin + i / 10
            points = np.full((10, 3), 1.0 + i)
            entries.append(("/livox", t + 0.03, ros.livox(t - zero, range(10), points)))
    return ros.write(path, sorted(entries, key=lambda entry: entry[1]))


def test_the_sensors_of_a_device_that_began_again_stay_together(tmp_path, ros1):
    batches, recording = read(two_sessions(ros1, tmp_path / "a.bag"), HEAD)
    lidar, imu, _ = batches
    clouds, samples = joined(lidar, "times")[::10], joined(imu, "times")
    assert (len(clouds), len(samples)) == (80, 800)
    np.testing.assert_allclose(
        clouds[40:] - samples[400::10], clouds[:40] - samples[:400:10], atol=1e-6
    )
    np.testing.assert_allclose(clouds[40:], 24 + np.arange(40) / 10, atol=0.04)
    assert sum("the clock was set while recording" in w for w in recording.warnings) == 2


def test_a_session_is_read_by_itself(tmp_path, ros1):
    with Recording(two_sessions(ros1, tmp_path / "a.bag"), HEAD) as recording:
        batches = list(recording.batches(start=20.0, duration=10.0))
    points = np.concatenate([b.points for b in batches if isinstance(b, LidarBatch)])
    np.testing.assert_array_equal(points[::10, 0], 1.0 + np.arange(40))


def test_an_lvx2_file_of_two_sessions_is_read_whole(tmp_path):
    points = [(1000, 0, i, 0, 0) for i in range(96)]
    frames = [
        [Package(begin + (f * 100 + i) * PACKAGE_NS, points) for i in range(100)]
        for begin in (100 * S, 5 * S)
        for f in range(20)
    ]
    (lidar, _, _), recording = read(write_lvx2(tmp_path / "a.lvx2", frames), NO_IMU)
    times = joined(lidar, "times")
    assert len(times) == 40 * 100 * 96
    np.testing.assert_allclose(times, np.arange(len(times)) * 5e-6, atol=0.003)
    assert sum("the clock was set while recording" in w for w in recording.warnings) == 1


def shifts(pairs):
    """What is added to the stamps of (header, recorder) pairs in s, all noticed before, s."""
    steps = ClockSteps(0, [])
    for header, recorder in pairs:
        steps.notice(round(header * S), round(recorder * S))
    return [steps.shift_ns(round(recorder * S)) / S for _, recorder in pairs]


def test_every_step_adds_to_those_before():
    pairs = [(t + (t >= 10) * 100 - (t >= 20) * 1000, t) for t in range(30)]
    assert shifts(pairs) == [0] * 10 + [-100] * 10 + [900] * 10


def test_damaged_stamps_are_no_step():
    pairs = [(t + (100 if t in (3, 7, 11) else 0), t) for t in range(20)]
    pairs += [(20 + 100 * i, 20) for i in range(1, 3 * CONFIRMED)]
    assert shifts(pairs) == [0] * len(pairs)


def test_a_recorder_whose_own_clock_was_set_is_none():
    assert shifts([(t / 10, t / 10 + (t >= 10) * 1000) for t in range(30)]) == [0] * 30
