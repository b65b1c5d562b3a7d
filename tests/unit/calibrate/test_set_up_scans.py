# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which scans of a 2D lidar are worth comparing: those of a head that turns."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.calibrate.set_up.scans import Scans
from bentwing.recording.batches import LidarBatch

RATE, LENGTH, STARTS = 40.0, 12.0, 4.0  # scans a second, s, s


def scans(turning):
    """Scans of surroundings whose distance depends on where a scan looks, with noise."""
    rng = np.random.default_rng(1)
    times = np.arange(0.0, LENGTH, 1.0 / RATE)
    azimuths = np.linspace(-2.3, 2.3, 200)
    points, stamps = [], []
    for time in times:
        angle = turning * max(0.0, time - STARTS)
        ranges = np.exp(1.0 + 0.5 * np.sin(2.0 * azimuths + angle)) + 0.01 * rng.normal(size=200)
        points.append(np.c_[ranges * np.cos(azimuths), ranges * np.sin(azimuths), np.zeros(200)])
        stamps.append(time + np.linspace(0.0, 0.9 / RATE, 200))
    return Scans(LidarBatch(np.concatenate(points), np.concatenate(stamps)))


def test_scans_at_rest_say_nothing_of_how_the_lidar_is_mounted():
    seen = scans(turning=3.0)
    rest = seen.times < STARTS - 0.3
    moving = seen.times > STARTS + 0.3
    assert not seen.changing[rest].any()
    assert seen.changing[moving].mean() > 0.95


@pytest.mark.parametrize("turning", [0.0, 3.0])
def test_some_scans_always_remain(turning):
    assert scans(turning).changing.any()
