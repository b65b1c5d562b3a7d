# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which parts of a recording are revolutions at rest, and what is said where there are none."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base.errors import NotEnoughDataError, RecordingError
from bentwing.calibrate.revolution import Course, find_stretches
from bentwing.recording import ImuBatch


def course(rate, length=8.0, *, moving=(), imu=True):
    """A motor whose rate is a function of time, and a carrier that moves between two times."""
    times = np.arange(0.0, length, 0.005)
    angles = np.cumsum(np.vectorize(rate)(times)) * 0.005
    if not imu:
        return Course(times, angles, None)
    rng = np.random.default_rng(3)
    gyro = rng.normal([0.004, -0.003, 0.002], 0.007, (len(times), 3))
    accel = rng.normal([0.1, 0.2, 9.8], 0.1, (len(times), 3))
    if moving:
        inside = (times > moving[0]) & (times < moving[1])
        gyro[inside, 2] += 0.6
    return Course(times, angles, ImuBatch(times, gyro, accel))


def test_whole_revolutions_are_found_behind_the_start_of_the_motor():
    (found,) = find_stretches(course(lambda t: 2.0 * min(t, 1.0), 9.0))
    assert found.n_turns == 2
    assert 0.8 < found.start < 1.4
    assert abs(2.0 * (found.stop - found.start) - 4 * np.pi) < 0.25
    assert abs(found.rate - 2.0) < 0.01


def test_both_directions_are_found():
    found = find_stretches(course(lambda t: 3.0 if t < 4.0 else -3.0, 8.0))
    assert [round(s.rate) for s in found] == [3, -3]
    assert all(s.n_turns == 1 for s in found)


def test_only_what_is_at_rest_counts():
    (found,) = find_stretches(course(lambda _: 3.0, 12.0, moving=(5.0, 11.9)))
    assert found.n_turns == 2
    assert found.stop < 5.0


@pytest.mark.parametrize(
    ("made", "error", "says"),
    [
        (Course(np.zeros(0), np.zeros(0), None), RecordingError, "encoder sends no angles"),
        (course(lambda _: 0.5), NotEnoughDataError, "229°.*whole revolution"),
        (course(lambda t: 2.0 + 1.5 * np.sin(2 * t)), RecordingError, "constant rate"),
        (course(lambda _: 3.0, moving=(0.0, 8.0)), RecordingError, "carrier moves .*put it down"),
        (course(lambda _: 1.0, moving=(3.0, 4.0)), RecordingError, "carrier moves"),
    ],
)
def test_what_cannot_be_used_is_refused_in_a_sentence(made, error, says):
    with pytest.raises(error, match=says):
        find_stretches(made)


def test_without_an_imu_rest_is_believed():
    (found,) = find_stretches(course(lambda _: 3.0, imu=False))
    assert found.n_turns == 3
