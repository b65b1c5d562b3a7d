# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where a trajectory begins."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.calibration import STANDARD_GRAVITY
from bentwing.odometry.start import FIRST_RATE, find_start
from bentwing.recording.batches import ImuBatch
from bentwing.recording.sections.imu import Imu

PERIOD = 0.005  # s


@pytest.mark.parametrize("first", [0.0, 0.35])
def test_a_start_in_motion_is_level_on_a_head_that_nods(first):
    """The IMU nods with the head, so that the mean of its own readings points to no side in particular."""
    times = np.arange(0.0, 4.0, PERIOD)
    nod = 1.2 * np.sin(2.0 * np.pi * 0.8 * times)
    attitude = geometry.exp(np.stack([np.full_like(nod, 0.1), nod, np.zeros_like(nod)], axis=1))
    change = geometry.multiply(geometry.inverse(attitude[:-1]), attitude[1:])
    rates = geometry.log(change) / PERIOD
    gyro = np.concatenate([rates[:1], 0.5 * (rates[1:] + rates[:-1]), rates[-1:]])
    up = np.broadcast_to([0.0, 0.0, STANDARD_GRAVITY], (len(times), 3))
    accel = geometry.rotate(geometry.inverse(attitude), up)

    start = find_start(ImuBatch(times, gyro, accel), Imu(), first)

    assert start.static is None
    true = attitude[round(first / PERIOD)]
    tilt = geometry.rotate(start.quat_xyzw, geometry.rotate(geometry.inverse(true), up[0]))
    assert tilt / STANDARD_GRAVITY == pytest.approx([0.0, 0.0, 1.0], abs=0.01)
    behind = times[np.searchsorted(times, first) :]
    soon = np.isin(times, behind[behind < behind[0] + FIRST_RATE])
    assert start.rate == pytest.approx(gyro[soon].mean(axis=0))
