# SPDX-License-Identifier: MIT OR Apache-2.0
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bentwing.base.errors import UsageError
from bentwing.flight.control import SpinController, SpinSettings, SpinTarget
from bentwing.flight.control.spin_target import structure_support

ANYTHING = st.floats(allow_nan=True, allow_infinity=True)
SETTINGS = SpinSettings()
RATE = math.radians(300.0)


def command(measured, *, desired=RATE, age=0.0):
    return SpinController().command(10.0, measured, measured_at=10.0 - age, desired=desired)


@given(measured=ANYTHING, desired=ANYTHING, time=ANYTHING, measured_at=ANYTHING)
def test_the_angle_is_finite_and_never_leaves_its_limits(measured, desired, time, measured_at):
    made = SpinController().command(time, measured, measured_at=measured_at, desired=desired)
    assert SETTINGS.lowest_angle <= made.angle <= SETTINGS.highest_angle


@given(measured=st.floats(-60.0, 60.0), desired=st.floats(0.0, 20.0))
def test_the_same_input_gives_the_same_angle_from_any_controller(measured, desired):
    first = SpinController().command(1.0, measured, measured_at=0.9, desired=desired)
    used = SpinController()
    used.command(0.5, 3.0, measured_at=0.5, desired=5.0)
    assert used.command(1.0, measured, measured_at=0.9, desired=desired) == first


@pytest.mark.parametrize(
    ("measured", "age", "reason"),
    [
        (math.nan, 0.0, "is nan"),
        (math.inf, 0.0, "is inf"),
        (100.0, 0.0, "beyond"),
        (5.0, 1.0, "old"),
        (5.0, -0.1, "future"),
        (5.0, math.nan, "no finite time"),
    ],
)
def test_a_measurement_that_cannot_be_used_leaves_the_map_alone(measured, age, reason):
    made = command(measured, age=age)
    assert reason in made.faults[0]
    assert made.angle == pytest.approx(SETTINGS.map_gain * math.radians(300.0))
    assert not made.is_preventing_stall


def test_the_terms_are_those_of_figure_10():
    made = command(math.radians(280.0))
    assert made.map == pytest.approx(SETTINGS.map_gain * math.radians(300.0))
    assert made.proportional == pytest.approx(SETTINGS.proportional_gain * math.radians(20.0))
    assert made.stall == 0.0
    assert made.angle == pytest.approx(made.map + made.proportional)


def test_below_180_degrees_per_second_45_degrees_are_added():
    assert command(math.radians(180.5)).stall == 0.0
    assert command(math.radians(179.5)).stall == pytest.approx(math.radians(45.0))


@pytest.mark.parametrize(("wish_deg", "held_deg"), [(20.0, 180.0), (900.0, 540.0), (250.0, 250.0)])
def test_the_desired_rate_is_limited_to_what_may_be_commanded(wish_deg, held_deg):
    made = command(math.radians(250.0), desired=math.radians(wish_deg))
    assert made.map == pytest.approx(SETTINGS.map_gain * math.radians(held_deg))


def test_a_desired_rate_that_is_not_finite_is_reported():
    made = command(math.radians(250.0), desired=math.nan)
    assert "desired rate is nan" in made.faults[0]
    assert made.map == pytest.approx(SETTINGS.map_gain * math.radians(180.0))


@pytest.mark.parametrize(
    "wrong",
    [
        {"map_gain": math.nan},
        {"stall_rate": -1.0},
        {"lowest_desired": 20.0},
        {"highest_angle": 2.0},
    ],
)
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(UsageError):
        SpinSettings(**wrong)


def normals(weights, n=3000):
    rng = np.random.default_rng(0)
    table = rng.normal(size=(n, 3)) * weights
    return table / np.linalg.norm(table, axis=1, keepdims=True)


def test_rich_structure_spins_faster_than_open_terrain():
    target = SpinTarget(slowest=math.radians(180.0), fastest=math.radians(400.0))
    assert target.rate(normals([1.0, 1.0, 1.0])) == pytest.approx(math.radians(400.0))
    assert target.rate(normals([0.02, 0.02, 1.0])) == pytest.approx(math.radians(180.0))
    between = target.rate(normals([0.15, 0.15, 1.0]))
    assert math.radians(180.0) < between < math.radians(400.0)


def test_few_surfels_keep_the_slowest_rate():
    target = SpinTarget(slowest=3.0, fastest=7.0)
    assert target.rate(normals([1.0, 1.0, 1.0], n=50)) == 3.0
    assert target.rate(np.empty((0, 3))) == 3.0


@given(st.integers(1, 50), st.integers(0, 1000))
def test_the_support_does_not_depend_on_the_frame_or_the_signs(n, seed):
    rng = np.random.default_rng(seed)
    table = rng.normal(size=(n, 3))
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    flipped = (table * rng.choice([-1.0, 1.0], (n, 1))) @ turn
    assert structure_support(flipped) == pytest.approx(structure_support(table), abs=1e-9)


def test_normals_that_are_not_finite_are_refused():
    with pytest.raises(ValueError, match="row 1 is not finite"):
        structure_support([[1.0, 0.0, 0.0], [math.nan, 0.0, 0.0]])
