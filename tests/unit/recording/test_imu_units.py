# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from bentwing.recording import ImuUnits, imu_units

G = 9.80665
RATE_HZ = 100


def moving_imu(rates, seconds=10.0, seed=0):
    """Return times, gyro (rad/s) and accel (m/s²) of an IMU turned at body rates(t) (3,)."""
    rng = np.random.default_rng(seed)
    times = np.arange(0, seconds, 1 / RATE_HZ)
    gyro = np.array([rates(t) for t in times])
    up = np.array([0.0, 0.0, 1.0])
    accel = np.empty_like(gyro)
    for i, omega in enumerate(gyro):
        accel[i] = G * up
        angle = np.linalg.norm(omega) / RATE_HZ
        if angle > 0:
            axis = omega / np.linalg.norm(omega)
            along = axis * (axis @ up)
            up = along + np.cos(angle) * (up - along) - np.sin(angle) * np.cross(axis, up)
    gyro += rng.normal(0, 0.01, gyro.shape)
    accel += rng.normal(0, 0.3, accel.shape)
    return times, gyro, accel


def resting(_):
    return (0.0, 0.0, 0.0)


def handheld(t):
    return (0.8 * np.cos(2 * t), 0.6 * np.sin(1.3 * t), 0.4 * np.sin(0.7 * t))


def spinning(rate):
    return lambda t: (rate * np.cos(0.2 * t), rate * np.sin(0.2 * t), 0.1)


@pytest.mark.parametrize(
    "rates",
    [resting, handheld, spinning(1.0), spinning(6.0), spinning(20.0), lambda _: (0, 0, 6.0)],
    ids=["rest", "handheld", "spin 1", "spin 6", "spin 20", "spin about the vertical"],
)
def test_a_valid_imu_is_never_refused(rates):
    samples = moving_imu(rates)
    assert imu_units.problems(*samples) == []
    assert imu_units.mirrored_axis(*samples) is None


def test_a_head_swung_like_a_pendulum_is_not_refused():
    """Below its pivot and faster than free, apparent gravity turns against the gyro."""
    times, gyro, accel = moving_imu(lambda t: (0.0, 2.0 * np.cos(7 * t), 0.0))
    lever = 0.4
    accel[:, 0] -= lever * np.gradient(gyro[:, 1], times)
    assert imu_units.problems(times, gyro, accel) == []


@pytest.mark.parametrize("turn", [(1, 1, -1), (1, -1, -1), (-1, 1, -1)])
def test_an_imu_mounted_upside_down_is_fine(turn):
    times, gyro, accel = moving_imu(handheld)
    signs = np.array(turn) * (np.prod(turn))
    assert imu_units.problems(times, gyro * signs, accel * signs) == []


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(1 / G, "in g "), (1000 / G, "in milli-g "), (1100 / G, "in milli-g "), (100, "in cm/s² ")],
)
def test_accelerations_in_other_units_are_named_with_their_factor(factor, unit):
    times, gyro, accel = moving_imu(handheld)
    (problem,) = imu_units.problems(times, gyro, accel * factor)
    assert unit in problem
    repaired = imu_units.in_si(times, gyro, accel * factor)[1]
    assert np.median(np.linalg.norm(repaired, axis=1)) == pytest.approx(G, rel=0.15)


def test_accelerations_of_zero_and_raw_counts_are_refused():
    times, gyro, accel = moving_imu(resting)
    assert "all zero" in imu_units.problems(times, gyro, accel * 0)[0]
    assert "check the unit" in imu_units.problems(times, gyro, accel * 1670)[0]


def test_centrifugal_force_far_off_the_axis_is_not_a_unit():
    times, gyro, accel = moving_imu(spinning(15.0))
    lever = np.array([0.0, 0.0, 0.35])
    accel += np.cross(gyro, np.cross(gyro, lever))
    assert np.median(np.linalg.norm(accel, axis=1)) > 60
    assert imu_units.problems(times, gyro, accel) == []


def test_vibration_of_a_drone_is_not_a_unit():
    times, gyro, accel = moving_imu(resting)
    rng = np.random.default_rng(1)
    assert imu_units.problems(times, gyro, accel + rng.normal(0, 8, accel.shape)) == []


@pytest.mark.parametrize("rates", [handheld, spinning(0.4)], ids=["handheld", "slow spin"])
def test_rates_in_degrees_are_found_from_gravity(rates):
    times, gyro, accel = moving_imu(rates)
    degrees = np.degrees(gyro)
    if np.linalg.norm(degrees, axis=1).max() > imu_units.MAX_RATE:
        degrees *= 0.5 * imu_units.MAX_RATE / np.linalg.norm(degrees, axis=1).max()
        times, gyro, accel = moving_imu(lambda t: 0.3 * np.array(rates(t)))
        degrees = np.degrees(gyro)
    (problem,) = imu_units.problems(times, degrees, accel)
    assert "deg/s" in problem
    assert imu_units.gyro_scale(times, degrees, accel) == pytest.approx(np.pi / 180)


def test_rates_beyond_every_gyro_are_degrees():
    times, gyro, accel = moving_imu(lambda _: (0, 0, 2.0))
    (problem,) = imu_units.problems(times, np.degrees(gyro), accel)
    assert "deg/s" in problem
    assert "0.0174533" in problem


@pytest.mark.parametrize("axis", [0, 1])
def test_a_mirrored_gyro_axis_is_named(axis):
    times, gyro, accel = moving_imu(handheld)
    gyro[:, axis] *= -1
    assert f"axis {'xyz'[axis]}" in imu_units.mirrored_axis(times, gyro, accel)


def test_a_few_samples_tell_nothing():
    assert imu_units.problems(np.arange(3.0), np.ones((3, 3)), np.ones((3, 3))) == []


@pytest.mark.parametrize("rates", [resting, handheld, spinning(6.0)])
def test_units_that_the_payload_is_right_about_are_not_refused(rates):
    times, gyro, accel = moving_imu(rates)
    assert imu_units.problems(times, gyro, accel, ImuUnits(accel="g", gyro="deg/s")) == []


def test_units_that_gravity_contradicts_are_refused():
    times, gyro, accel = moving_imu(handheld)
    units = ImuUnits(accel="g", gyro="deg/s")
    found = imu_units.problems(times, np.radians(gyro), G * accel, units)
    assert [text.rpartition("; ")[2] for text in found] == [
        "remove imu.units.accel",
        "remove imu.units.gyro",
    ]
