# SPDX-License-Identifier: MIT OR Apache-2.0
"""How an IMU follows a lidar, on motion whose truth is exact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bentwing.calibrate.set_up.hand_eye import fit_accel, fit_gyro
from bentwing.calibrate.set_up.motion import LONG_HALF, LidarMotion
from bentwing.recording import ImuBatch

GRAVITY = np.array([0.0, 0.0, 9.81])
MOUNT = Rotation.from_euler("xyz", [30, -50, 110], degrees=True).as_matrix()
STEP = 1e-3


def attitude(t: np.ndarray) -> Rotation:
    angles = [0.5 * np.sin(1.3 * t), 0.4 * np.sin(0.9 * t + 1), 0.8 * np.sin(0.7 * t + 2)]
    return Rotation.from_euler("xyz", np.transpose(angles))


def acceleration(t: np.ndarray) -> np.ndarray:
    return np.stack([1.5 * np.sin(1.7 * t), 1.2 * np.cos(1.1 * t), 0.8 * np.sin(2.3 * t)], axis=-1)


def seen_acceleration(t: np.ndarray) -> np.ndarray:
    """Return what the second differences of the positions are."""
    size = [
        1.5 * np.sin(1.7 * t) / 1.7**2,
        1.2 * np.cos(1.1 * t) / 1.1**2,
        0.8 * np.sin(2.3 * t) / 2.3**2,
    ]
    bends = [4 * np.sin(w * LONG_HALF / 2) ** 2 / LONG_HALF**2 for w in (1.7, 1.1, 2.3)]
    return np.stack(size, axis=-1) * bends


def rates(t: np.ndarray) -> np.ndarray:
    turn = attitude(t - STEP).inv() * attitude(t + STEP)
    return turn.as_rotvec() / (2 * STEP)


@pytest.fixture(scope="module")
def motion() -> LidarMotion:
    t = np.arange(0.0, 16.0, 0.01)
    return LidarMotion(t, attitude(t).as_matrix(), rates(t), seen_acceleration(t), ())


@pytest.fixture(scope="module")
def imu() -> ImuBatch:
    t = np.arange(-6.0, 22.0, 0.005)
    in_lidar = attitude(t).inv().apply(acceleration(t) + GRAVITY)
    rng = np.random.default_rng(7)
    gyro = rates(t) @ MOUNT.T + rng.normal(0.02, 0.01, (len(t), 3))
    return ImuBatch(t, gyro, in_lidar @ MOUNT.T + rng.normal(0.0, 0.1, (len(t), 3)))


@pytest.mark.parametrize("delay", [0.0, 0.043, -0.5, 1.0, 3.0])
def test_the_delay_is_found_to_a_few_milliseconds(
    motion: LidarMotion, imu: ImuBatch, delay: float
) -> None:
    found = fit_gyro(motion, replace(imu, times=imu.times - delay))
    assert found.delay == pytest.approx(delay, abs=0.003)
    assert found.correlation > 0.99


@pytest.mark.parametrize("scale", [1.0, 1.2, 180 / np.pi])
def test_rotation_and_scale_are_found_whatever_they_are(
    motion: LidarMotion, imu: ImuBatch, scale: float
) -> None:
    found = fit_gyro(motion, replace(imu, gyro=scale * imu.gyro))
    np.testing.assert_allclose(found.M, MOUNT, atol=0.01)
    assert found.scale == pytest.approx(scale, rel=0.01)
    assert found.left < 0.2 * found.mirrored_left


def test_a_mirrored_gyro_shows_as_a_reflection(motion: LidarMotion, imu: ImuBatch) -> None:
    flip = np.diag([1.0, -1.0, 1.0])
    found = fit_gyro(motion, replace(imu, gyro=imu.gyro @ flip))
    np.testing.assert_allclose(found.M, flip @ MOUNT, atol=0.01)
    assert found.left < 0.2 * found.mirrored_left


def test_motion_about_one_axis_does_not_tell_the_hand(motion: LidarMotion, imu: ImuBatch) -> None:
    about_x = motion.rates * [1.0, 0.0, 0.0]
    gyro = np.interp(imu.times, motion.times, about_x[:, 0])[:, None] * MOUNT[:, 0]
    found = fit_gyro(replace(motion, rates=about_x), replace(imu, gyro=gyro))
    assert found.left == pytest.approx(found.mirrored_left, rel=0.01)


def test_the_gyro_of_another_head_does_not_correlate(motion: LidarMotion, imu: ImuBatch) -> None:
    rng = np.random.default_rng(3)
    walk = np.cumsum(rng.normal(0.0, 0.05, imu.gyro.shape), axis=0)
    assert fit_gyro(motion, replace(imu, gyro=walk)).correlation < 0.9


def test_forces_give_gravity_and_the_unit_of_the_ranges(motion: LidarMotion, imu: ImuBatch) -> None:
    found = fit_accel(motion, imu, 0.0, MOUNT)
    np.testing.assert_allclose(found.gravity, GRAVITY, atol=0.02)
    assert found.slope == pytest.approx(1.0, abs=0.03)
    assert found.left < 0.1


def test_ranges_that_are_too_long_show_in_the_slope(motion: LidarMotion, imu: ImuBatch) -> None:
    stretched = replace(motion, accelerations=1.3 * motion.accelerations)
    assert fit_accel(stretched, imu, 0.0, MOUNT).slope == pytest.approx(1 / 1.3, abs=0.03)


def test_a_negated_accelerometer_shows_in_the_sign_of_the_slope(
    motion: LidarMotion, imu: ImuBatch
) -> None:
    assert fit_accel(motion, replace(imu, accel=-imu.accel), 0.0, MOUNT).slope < -0.9
