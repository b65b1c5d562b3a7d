# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a live user hands over is read as the payload says, and a replay is not read twice."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from bentwing import Odometry, Payload
from bentwing.flight.live.inputs import InputOrder
from bentwing.recording.readings import Readings

HEAD = Payload.model_validate(
    {
        "lidar": {"latency": 0.9, "mirrored": True, "range_scale": 1e-3},
        "imu": {
            "axes": ["y", "-x", "z"],
            "units": {"accel": "g", "gyro": "deg/s"},
            "clock_offset": 1.7e9,
        },
        "encoder": {"unit": "deg", "sign": -1},
    }
)
TIMES = np.array([10.0, 10.5])


def test_inertial_samples_are_taken_to_the_imu_frame_in_si_units_on_the_common_clock():
    order = InputOrder()
    gyro, accel = np.tile([10.0, 20.0, 30.0], (2, 1)), np.tile([0.1, 0.2, 1.0], (2, 1))
    batch = order.imu(TIMES - 1.7e9, gyro, accel, Readings.of(HEAD).imu)
    np.testing.assert_allclose(batch.times, TIMES, rtol=0, atol=3e-7)
    np.testing.assert_allclose(batch.gyro[0], np.radians([20.0, -10.0, 30.0]))
    np.testing.assert_allclose(batch.accel[0], 9.80665 * np.array([0.2, -0.1, 1.0]))


def test_points_are_scaled_mirrored_and_freed_of_a_large_latency():
    batch = InputOrder().points([[1000, 2000, 3000]] * 2, TIMES, reading=Readings.of(HEAD).lidar)
    np.testing.assert_allclose(batch.times, TIMES - 0.9)
    np.testing.assert_allclose(batch.points[0], [1.0, -2.0, 3.0])


def test_angles_are_turned_into_radians_about_the_axis_on_the_lidars_clock():
    batch = InputOrder().encoder(TIMES, [90.0, 180.0], Readings.of(HEAD).encoder)
    np.testing.assert_allclose(batch.times, TIMES - 0.9)
    np.testing.assert_allclose(batch.angles, [-np.pi / 2, -np.pi])


def test_samples_that_go_back_are_refused_on_the_common_clock():
    order = InputOrder()
    reading = Readings.of(HEAD).imu
    order.accept(order.imu(TIMES - 1.7e9, np.ones((2, 3)), np.ones((2, 3)), reading))
    with pytest.raises(ValueError, match=r"begins before 10\.500000 s"):
        order.imu(10.2 - 1.7e9, np.ones(3), np.ones(3), reading)


def test_a_replayed_batch_is_not_read_a_second_time(monkeypatch):
    taken = []
    with Odometry(HEAD) as odometry:
        monkeypatch.setattr(odometry, "_take", taken.append)
        order, read = InputOrder(), Readings.of(HEAD)
        batches = [
            order.imu(TIMES - 1.7e9, np.ones((2, 3)), np.ones((2, 3)), read.imu),
            order.points(np.ones((2, 3)), TIMES, reading=read.lidar),
            order.encoder(TIMES, [1.0, 2.0], read.encoder),
        ]
        for batch in batches:
            odometry.feed(batch)
        odometry.add_points(np.ones((2, 3)), TIMES)
    assert taken[:3] == batches
    assert taken[3] == batches[1]


def test_stamps_of_a_host_are_put_where_their_clocks_say(monkeypatch):
    taken, rng = [], np.random.default_rng(3)
    with Odometry(HEAD) as odometry:
        monkeypatch.setattr(odometry, "_take", lambda batch, given: taken.append((batch, given)))
        begins = np.arange(0.0, 20.0, 0.025)
        for stamp in begins + 6e-4 * rng.gamma(4.0, 1.0, len(begins)):
            times = stamp + np.linspace(0.0, 0.02, 5)
            odometry.add_points(np.ones((5, 3)), times, stamp=stamp)
    first, raw = (np.array([pair[i].times[0] for pair in taken]) for i in (0, 1))
    known = begins > 5.0
    assert np.std((first - begins)[known]) < 0.2 * np.std((raw - begins)[known])
    assert all(a[0].times[-1] <= b[0].times[0] for a, b in pairwise(taken))
