# SPDX-License-Identifier: MIT OR Apache-2.0
"""Runs against structure: the bumper keeps clear where the pilot alone does not."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.flight.control import BumperSettings
from bentwing.flight.control.bumper import GRAVITY
from bentwing.simulate.push.quadrotor import Quadrotor, QuadrotorSettings
from bentwing.simulate.push.runs import PushRun, run_push


@pytest.mark.parametrize(("place", "seed"), [("office", 0), ("cave", 0)])
def test_the_bumper_keeps_clear_where_the_pilot_alone_touches(place, seed):
    run = PushRun(place, seed=seed, duration=4.0)
    kept, left = run_push(run), run_push(PushRun(place, seed=seed, duration=4.0, with_bumper=False))
    assert left.touched
    assert not kept.touched
    assert kept.least_gap > 0.1
    assert kept.largest_push <= GRAVITY * np.tan(BumperSettings().max_push) + 1e-9


def test_a_drift_in_wind_is_held():
    kept = run_push(PushRun("office", "drift", seed=3, duration=4.0))
    assert not kept.touched


def test_the_same_seed_flies_the_same_path():
    first, second = (run_push(PushRun("door", seed=2, duration=1.5)) for _ in "ab")
    np.testing.assert_array_equal(first.path, second.path)


def test_a_quadrotor_tilted_forward_reaches_the_speed_where_drag_holds():
    carrier = Quadrotor(QuadrotorSettings(), np.zeros(3), np.zeros(3), yaw=np.pi / 2)
    for _ in range(6000):
        carrier.step(0.0, 0.1, np.zeros(2), 0.01)
    speed = GRAVITY * np.tan(0.1) / carrier.settings.drag
    np.testing.assert_allclose(carrier.velocity, [0.0, speed, 0.0], atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("place", ["office", "cave", "forest", "door"])
def test_no_run_touches_in_any_scene(place):
    for seed in range(100, 110):
        assert not run_push(PushRun(place, seed=seed)).touched, (place, seed)
