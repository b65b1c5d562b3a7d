# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from bentwing.recording.preprocess.static_init import find_static_start, level_attitude

G = 9.81
RATE_HZ = 200
BIAS = np.array([0.004, -0.003, 0.002])


def imu(static, moving, *, gyro_noise=0.005, accel_noise=0.05, spin=4.0, up=(0, 0, 1), seed=0):
    """Return times, gyro, accel of an IMU at rest that then spins up within a second."""
    rng = np.random.default_rng(seed)
    times = np.arange(0, static + moving, 1 / RATE_HZ)
    gyro = BIAS + rng.normal(0, gyro_noise, (len(times), 3))
    gyro[:, 2] += spin * np.clip(times - static, 0, 1)
    accel = G * np.asarray(up, float) + rng.normal(0, accel_noise, (len(times), 3))
    return times, gyro, accel


def test_the_static_stretch_ends_shortly_before_the_motion():
    start = find_static_start(*imu(5.0, 3.0))
    assert start.start == 0.0
    assert 4.5 < start.end < 5.0
    np.testing.assert_allclose(start.gyro_bias, BIAS, atol=5 * start.gyro_bias_std.max())


def test_a_recording_that_never_moves_is_static_throughout():
    start = find_static_start(*imu(5.0, 0.0))
    assert start.n_samples == 1000


@pytest.mark.parametrize("spin", [1.0, 6.0])
def test_a_recording_that_starts_in_steady_spin_is_not_static(spin):
    times, gyro, accel = imu(5.0, 0.0)
    gyro[:, 2] += spin
    assert find_static_start(times, gyro, accel) is None


def test_a_recording_that_starts_in_unsteady_motion_is_not_static():
    times, gyro, accel = imu(0.0, 5.0)
    gyro[:, 0] += np.sin(5 * times)
    assert find_static_start(times, gyro, accel) is None


def test_less_than_half_a_second_is_not_enough():
    assert find_static_start(*imu(0.6, 3.0)) is None
    assert find_static_start(*imu(1.0, 3.0)) is not None


def test_slow_tilting_is_not_static():
    times, gyro, accel = imu(5.0, 0.0)
    accel[:, 0] += 0.3 * times
    assert find_static_start(times, gyro, accel) is None


def test_vibration_beyond_the_limit_in_single_samples_is_still_static():
    start = find_static_start(*imu(5.0, 3.0, gyro_noise=0.05))
    assert start.end > 4.0


def test_the_standard_deviation_is_that_of_repeated_means():
    starts = [find_static_start(*imu(4.0, 0.0, seed=seed)) for seed in range(60)]
    means = np.array([start.gyro_bias for start in starts])
    claimed = np.array([start.gyro_bias_std for start in starts])
    ratio = means.std(axis=0) / claimed.mean(axis=0)
    assert np.all((ratio > 0.6) & (ratio < 1.4))


def test_correlated_vibration_widens_the_standard_deviation():
    times, gyro, accel = imu(4.0, 0.0)
    slow = np.interp(times, np.arange(0, 5, 0.25), np.random.default_rng(1).normal(0, 0.01, 20))
    wider = find_static_start(times, gyro + slow[:, None], accel)
    assert np.all(wider.gyro_bias_std > 3 * find_static_start(times, gyro, accel).gyro_bias_std)


@pytest.mark.parametrize("up", [(0, 0, 1), (0, 0, -1), (0.6, 0, 0.8), (0, -1, 0), (0.1, 0.7, -0.7)])
def test_the_attitude_turns_gravity_up_without_yaw(up):
    up = np.array(up, float) / np.linalg.norm(up)
    start = find_static_start(*imu(4.0, 0.0, up=up))
    R = start.R_map_imu
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)
    np.testing.assert_allclose(R @ up, [0, 0, 1], atol=2e-3)
    assert np.arctan2(R[1, 0], R[0, 0]) == pytest.approx(0.0, abs=1e-12)


def test_level_attitude_is_the_identity_for_an_upright_imu():
    np.testing.assert_allclose(level_attitude(np.array([0, 0, G])), np.eye(3), atol=1e-15)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_a_few_samples_are_no_start(n):
    assert find_static_start(np.arange(n) / 100, np.zeros((n, 3)), np.zeros((n, 3))) is None
