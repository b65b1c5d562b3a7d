# SPDX-License-Identifier: MIT OR Apache-2.0
"""What vibration adds to an accelerometer's bias looks as if the IMU were elsewhere on its head."""

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.covariances import PoseCovariances
from bentwing.base.trajectory import Trajectory
from bentwing.odometry.continuous.slow_states import INITIAL_STD
from bentwing.odometry.unseen import Unseen, with_lever
from bentwing.odometry.unseen_lever import lever_covariance
from bentwing.recording.sections.imu import Imu

BIAS, RATE, REST = INITIAL_STD["accel_bias"], 5.0, 2.0
IMU = Imu(accel_noise=0.012)


def turning(angles, axis=(0.0, 0.0, 1.0)):
    """Return 20 s of a head that stands in one place and turns by `angles` of the time since a rest."""
    times = np.arange(0.0, 20.0, 0.01)
    turned = angles(np.maximum(times - REST, 0.0))
    return Trajectory(
        times, np.zeros((len(times), 3)), geometry.exp(turned[:, None] * np.array(axis))
    )


def spin(since):
    """A spin that is as fast after a fifth of a second as later."""
    return RATE * np.where(since < 0.2, 2.5 * since**2, since - 0.1)


def test_a_head_that_spins_takes_a_new_bias_for_another_place():
    std = np.sqrt(np.diag(lever_covariance(turning(spin), IMU)))
    # How it begins to spin says a little against it.
    assert std[:2] == pytest.approx(BIAS / RATE**2, rel=0.15)
    assert std[2] < 0.1 * std[0]


def test_the_noise_of_the_simulated_mistake_is_what_is_stated():
    """A bias that begins with the motion, and the lever arm that fits its forces best."""
    trajectory, step = turning(spin), 0.01
    rates = geometry.log(
        geometry.multiply(geometry.inverse(trajectory.quats_xyzw[:-1]), trajectory.quats_xyzw[1:])
    )
    square = np.square(rates[:, 2] / step)
    forces = BIAS * (trajectory.times[:-1] > REST)
    rows = np.stack([-square, np.ones(len(square))], axis=1)
    off = np.linalg.lstsq(rows, forces, rcond=None)[0][0]
    assert np.sqrt(lever_covariance(trajectory, IMU)[0, 0]) == pytest.approx(abs(off), rel=0.1)


def test_a_head_that_nods_or_does_not_turn_tells_a_bias_from_a_place():
    nodding = lever_covariance(
        turning(lambda since: 1.2 * np.sin(4.0 * since), (0.0, 1.0, 0.0)), IMU
    )
    assert np.sqrt(np.diag(nodding)).max() < 0.2 * BIAS / RATE**2
    assert np.allclose(lever_covariance(turning(lambda since: 0.0 * since), IMU), 0.0)


def test_without_an_imu_or_with_a_moment_only_there_is_nothing_to_add():
    trajectory = turning(spin)
    assert not lever_covariance(trajectory, None).any()
    assert not lever_covariance(trajectory.within([(0.0, 0.1)]), IMU).any()


def test_the_imu_is_elsewhere_and_the_lidar_is_not():
    times = np.array([0.0, 1.0, 2.0])
    quats = geometry.exp(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, np.pi], [0.0, 0.0, 2 * np.pi]]))
    trajectory = Trajectory(times, np.zeros((3, 3)), quats)
    lever = np.diag([1e-6, 4e-6, 9e-6])
    nothing = PoseCovariances(times, np.zeros((3, 6, 6)))
    free = Unseen(lever=lever).covariances(nothing, trajectory).matrices
    # Half a turn puts it on the other side, a whole one back.
    assert np.allclose(
        free[:, 3:, 3:], [np.zeros((3, 3)), np.diag([4e-6, 16e-6, 0.0]), np.zeros((3, 3))]
    )
    held = Unseen(lever=lever, in_map=True).covariances(nothing, trajectory).matrices
    assert np.allclose(held[:, 3:, 3:], lever)
    assert not free[:, :3].any()
    assert with_lever({"extrinsic_translation": [0.0, 0.0, 0.004]}, lever) == {
        "extrinsic_translation": pytest.approx([0.001, 0.002, 0.005])
    }
    assert with_lever({"latency": [0.1]}, lever) == {"latency": [0.1]}


@pytest.mark.parametrize("first", [0.0, 0.02, 0.1, 3.3])
def test_a_path_ends_wherever_it_does(first):
    """Whole steps from the start may be rounded to a little more than the end."""
    still = np.zeros((2, 3))
    for last in first + 0.05 * np.arange(4, 1200, 7):
        times = np.array([first, round(last, 2)])
        path = Trajectory(times, still, np.tile([0.0, 0.0, 0.0, 1.0], (2, 1)))
        assert np.allclose(lever_covariance(path, IMU), 0.0)
