# SPDX-License-Identifier: MIT OR Apache-2.0
"""What results hold of the core can be copied and pickled."""

import copy
import pickle

import numpy as np
import pytest

from bentwing import _core
from bentwing.odometry.continuous.slow_states import N_STATES

HERE = ((0.1, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
MOTOR = {
    "motor_axis": (0.0, 0.6, 0.8),
    "encoder_zero": 0.2,
    "T_motor_lidar": HERE,
    "motor_errors": ([1e-3, -2e-3], [[1e-4, 2e-4, 3e-4, 4e-4], [5e-4, 6e-4, 7e-4, 8e-4]]),
}


def pickled(value):
    return pickle.loads(pickle.dumps(value))


@pytest.mark.parametrize("again", [copy.deepcopy, pickled])
def test_surfels_come_back_as_they_were(extract, again):
    surfels = extract()
    other = again(surfels)
    assert len(other) == len(surfels) > 100
    for mine, its in zip(surfels.__getnewargs__(), other.__getnewargs__(), strict=True):
        assert np.array_equal(mine, its)


@pytest.mark.parametrize("again", [copy.deepcopy, pickled])
def test_samples_come_back_with_their_responses(register, again):
    samples = register().samples
    other = again(samples)
    assert other.start == samples.start
    assert np.array_equal(other.positions, samples.positions)
    assert np.allclose(other.quats_xyzw, samples.quats_xyzw, atol=1e-15)
    everywhere = list(range(len(samples)))
    assert np.array_equal(other.responses_at(everywhere), samples.responses_at(everywhere))


@pytest.mark.parametrize("again", [copy.deepcopy, pickled])
@pytest.mark.parametrize("motor", [{}, MOTOR])
def test_slow_states_come_back_as_they_were(states, again, motor):
    slow = states(latency=0.003, gyro_bias=(0.1, 0.2, 0.3), ranges=(-0.02, 4e-4), **motor)
    other = again(slow)
    assert np.abs(other.moved_from(slow)).max() < 1e-15
    assert other.latency == slow.latency == 0.003
    assert np.array_equal(other.gyro_bias, slow.gyro_bias)
    assert other.encoder_zero == slow.encoder_zero
    assert list(other.ranges) == list(slow.ranges) == [-0.02, 4e-4]
    assert other.motor_errors == slow.motor_errors == motor.get("motor_errors")
    assert (other.motor_lidar_translation is None) == (not motor)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({1: [0, 3, 2]}, r"level_starts: expected 3 increasing numbers from 0 to 2"),
        ({1: [0, 2]}, r"level_starts: expected 3 increasing numbers from 0 to 2"),
        ({1: [1, 1, 2]}, r"level_starts: expected 3 increasing numbers from 0 to 2"),
        ({3: np.zeros((3, 9))}, "expected as many covariances, normals and n_points as means, 2"),
        ({5: np.zeros(3)}, r"stamps: expected shape \(2,\), got \(3,\)"),
        ({0: [0.4, float("nan")]}, "voxel_sizes: expected a finite number"),
    ],
)
def test_columns_that_do_not_fit_together_are_refused(changes, sentence):
    columns = [
        [0.4, 0.8], [0, 1, 2], np.zeros((2, 3)), np.zeros((2, 9)), np.zeros((2, 3)), np.zeros(2),
        np.zeros(2), np.ones(2, np.uint32),
    ]  # fmt: skip
    for place, value in changes.items():
        columns[place] = value
    with pytest.raises(ValueError, match=sentence):
        _core.Surfels(*columns)


def test_responses_of_another_shape_are_refused():
    still = np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))
    with pytest.raises(ValueError, match=r"responses: expected a C-contiguous array \(K, 6, 57\)"):
        _core.Samples(0.0, 0.01, np.zeros((2, 3)), still, np.zeros((2, 5, N_STATES)))
