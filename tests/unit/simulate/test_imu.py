# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.simulate.imu import Imu, ImuErrors
from bentwing.simulate.kinematics import Motion

N = 20_000


def at_rest(errors, activity):
    """Errors (N, 6) of an IMU at rest."""
    imu = Imu(errors, np.random.default_rng(3), lambda times: np.full(len(times), activity))
    none = np.zeros((N, 3))
    motion = Motion(np.tile(np.eye(3), (N, 1, 1)), none, none, none, none, none)
    gyro, accel = imu.sample(np.arange(N) / 200, motion)
    return np.hstack([gyro, accel - [0.0, 0.0, 9.80665]])


@pytest.mark.parametrize("activity", [0.0, 1.0])
def test_the_payloads_densities_describe_what_is_left_at_the_nodes(activity):
    errors = ImuErrors(gyro_bias_walk=0.0, accel_bias_walk=0.0)
    samples = at_rest(errors, activity)
    samples -= samples.mean(axis=0)
    nodes = samples[:-2:2] / 4 + samples[1:-1:2] / 2 + samples[2::2] / 4
    # The weights 1/4, 1/2, 1/4 keep sqrt(3/4) of the white noise of a plain mean of two.
    measured = np.sqrt((nodes**2).mean(axis=0).reshape(2, 3).mean(axis=1) / 100 / 0.75)
    white = np.array([errors.gyro_noise, errors.accel_noise])
    expected = np.array(errors.densities()) if activity else white
    np.testing.assert_allclose(measured, expected, rtol=0.25 if activity else 0.05)


def test_the_bias_walks_by_its_density():
    errors = ImuErrors(0.0, 0.0, 1e-3, 1e-2, 0.0, 0.0, 0.0, 0.0)
    steps = np.diff(at_rest(errors, 0.0), axis=0)
    expected = np.repeat([1e-3, 1e-2], 3) / np.sqrt(200)
    np.testing.assert_allclose(steps.std(axis=0), expected, rtol=0.05)
