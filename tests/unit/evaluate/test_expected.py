# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.base.covariances import PoseCovariances
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.expected import expected_accuracy

STD = np.array([1e-3, 1e-3, 2e-3, 0.02, 0.02, 0.01])


def along_x(length):
    times = np.linspace(0.0, 10.0, 11)
    positions = np.outer(times / 10.0, [length, 0.0, 0.0])
    return Trajectory(times, positions, np.tile([0.0, 0.0, 0.0, 1.0], (11, 1)))


COVARIANCES = PoseCovariances(np.array([0.0, 10.0]), np.stack([np.zeros((6, 6)), np.diag(STD**2)]))


def test_the_least_certain_pose_speaks_for_the_whole_and_ten_metres_for_their_share():
    found = expected_accuracy(along_x(40.0), COVARIANCES, 0.01)
    # In a plane 68 % of the errors are within σ √(-2 ln 0.32).
    assert found.horizontal == pytest.approx(0.02 * np.sqrt(-2 * np.log(0.32)), rel=2e-3)
    assert found.vertical == pytest.approx(0.01)
    assert found.heading == pytest.approx(2e-3)
    assert found.vertical_per_10m == pytest.approx(0.005)
    assert found.map_thickness > 0.01


def test_of_a_short_path_ten_metres_are_the_whole():
    found = expected_accuracy(along_x(4.0), COVARIANCES, 0.01)
    assert found.vertical_per_10m == found.vertical


def test_the_sentence_has_figures_with_units():
    sentence = expected_accuracy(along_x(40.0), COVARIANCES, 0.01).sentence()
    assert "30 mm horizontally, 10 mm vertically and 0.11° in heading" in sentence
    assert "68 %" in sentence


def test_without_covariances_nothing_is_expected():
    assert expected_accuracy(along_x(4.0), None, 0.01) is None
