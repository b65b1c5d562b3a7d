# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a pass holds."""

from __future__ import annotations

import numpy as np

from bentwing import _core
from bentwing.base.trajectory import DT
from bentwing.odometry.continuous.core_settings import CoreSettings
from bentwing.odometry.continuous.odometry_pass import OdometryPass
from bentwing.odometry.continuous.settings import ContinuousSettings
from bentwing.odometry.continuous.slow_states import SlowStatePrior
from bentwing.recording import Payload

N = 60_000  # samples, ten minutes


def test_of_a_long_rest_only_the_end_is_held_ready():
    quats = np.tile([0.0, 0.0, 0.0, 1.0], (N, 1))
    slow = _core.Globals(
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)),
        latency=0.0,
        gyro_bias=np.zeros(3),
        accel_bias=np.zeros(3),
        gravity=(0.0, 0.0, 9.8),
    )
    settings = ContinuousSettings()
    resting = OdometryPass(
        _core.Samples(2.0, DT, np.zeros((N, 3)), quats),
        slow,
        SlowStatePrior(None, has_motor=False, moving=False, frozen=()),
        settings,
        CoreSettings.of(settings.registration, Payload.default(), DT),
        threads=1,
        resting=True,
    )
    assert len(resting.samples) * DT < settings.window
    trajectory = resting.trajectory()
    assert len(trajectory.times) == N
    assert trajectory.times[[0, -1]].tolist() == [2.0, 2.0 + (N - 1) * DT]
