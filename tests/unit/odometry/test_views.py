# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a window is held to, while a carrier moves along a wall."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing import _core
from bentwing.base.trajectory import DT
from bentwing.odometry.continuous.settings import ContinuousSettings
from bentwing.odometry.continuous.views import FixedViews

SETTINGS = ContinuousSettings()
DURATION, SHIFT = 6.0, 0.2  # s; a lidar alone has windows that follow each other as fast
STILL = _core.Globals(
    ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)),
    latency=0.0,
    gyro_bias=np.zeros(3),
    accel_bias=np.zeros(3),
    gravity=(0.0, 0.0, 9.8),
)


def moving(speed):
    times = DT * np.arange(round(DURATION / DT) + 1)
    positions = np.stack([speed * times, 0 * times, 0 * times], axis=1)
    return _core.Samples(0.0, DT, positions, np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1)))


def patches(start, samples):
    """Surfels of `SHIFT` seconds of a wall 4 m to the left of the carrier."""
    rng = np.random.default_rng(round(start / SHIFT))
    stamps = np.sort(rng.uniform(start, start + SHIFT, 4000))
    points = np.stack([rng.uniform(-3, 3, 4000), np.full(4000, 4.0), rng.uniform(-1, 1, 4000)], 1)
    return _core.extract_surfels(
        points, stamps, None, samples, STILL, settings=SETTINGS.surfels, range_sigma=0.01, threads=1
    )


def held_while_passing(speed):
    """How much of what was seen is in the views at the end, s; what is in two of them counts twice."""
    samples, views = moving(speed), FixedViews(SETTINGS)
    seen = []
    for start in SHIFT * np.arange(round(DURATION / SHIFT)):
        seen.append((start, patches(start, samples)))
        views.update(seen, start + SHIFT, samples, STILL)
    held = sum(len(v) for v in views.around(samples.position_at(DURATION)))
    return held * DURATION / sum(len(s) for _, s in seen)


@pytest.mark.parametrize("speed", [0.5, 15.0])
def test_no_look_at_a_surface_is_held_twice(speed):
    """It would weigh as much as two looks, and the views would reach back no farther than one."""
    assert 0 < held_while_passing(speed) < DURATION


def test_a_fast_carrier_is_held_to_most_of_its_way():
    assert held_while_passing(15.0) > 2 / 3 * DURATION


def test_a_slow_carrier_needs_views_from_apart_only():
    assert held_while_passing(0.5) < 2 / 3 * DURATION
