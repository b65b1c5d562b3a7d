# SPDX-License-Identifier: MIT OR Apache-2.0
"""A lidar whose stamps are late by a known latency: trajectories are on the clock of the IMU.

The same flight is estimated twice, the second time with later stamps of the lidar and a payload that says
so. A trajectory on the wrong clock is late by the latency.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bentwing import odometry
from bentwing.recording import LidarBatch

LATENCY = 0.05  # s, as a driver that stamps the end of a sweep


def late(batches):
    return [
        replace(b, times=b.times + LATENCY) if isinstance(b, LidarBatch) else b for b in batches
    ]


def with_latency(payload):
    lidar = payload.lidar.model_copy(update={"latency": payload.lidar.latency + LATENCY})
    return payload.model_copy(update={"lidar": lidar})


def delay(late_one, trajectory):
    """How much later the one trajectory is where the other one is now, s, by least squares."""
    times = np.arange(5.0, 10.8, 0.01)
    before, now, after = (trajectory.interpolate(times + dt)[0] for dt in (-0.01, 0.0, 0.01))
    velocities = (after - before) / 0.02
    off = now - late_one.interpolate(times)[0]
    off, varying = off - off.mean(axis=0), velocities - velocities.mean(axis=0)
    return float((off * varying).sum() / (varying**2).sum())


def test_a_known_latency_moves_no_pose_in_time(head, quick, plain_run, name):
    """Sweeps and scans are cut by the latency, so that they are the same ones.

    Windows are not, and their noise is another: 3 mm in a flight of a metre per second.
    """
    engine = odometry.create(name, with_latency(head.payload), quick[name], 1)
    for batch in late(head.batches):
        engine.feed(batch)
    found, plain = engine.result(), plain_run(name)
    tolerance = 3e-3 if name == "continuous" else 1e-6
    assert found.calibration.latency - plain.calibration.latency == pytest.approx(
        LATENCY, abs=tolerance
    )
    assert delay(found.trajectory, plain.trajectory) == pytest.approx(0.0, abs=tolerance)
