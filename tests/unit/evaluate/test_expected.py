# SPDX-License-Identifier: MIT OR Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from bentwing.base.calibration import Calibration
from bentwing.base.covariances import PoseCovariances
from bentwing.base.estimate import Estimate
from bentwing.base.mount import FixedMount, Pose
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.expected import expected_accuracy
from bentwing.evaluate.revisits import Revisits

STD = np.array([1e-3, 1e-3, 2e-3, 0.02, 0.02, 0.01])


def along_x(length):
    times = np.linspace(0.0, 10.0, 11)
    positions = np.outer(times / 10.0, [length, 0.0, 0.0])
    return Trajectory(times, positions, np.tile([0.0, 0.0, 0.0, 1.0], (11, 1)))


def estimated(length, short=None):
    level = Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    nothing = Calibration(0.0, FixedMount(level), np.zeros(3), np.zeros(3), np.array([0, 0, 9.8]))
    return Estimate(along_x(length), nothing, covariances=COVARIANCES, short_variances=short)


COVARIANCES = PoseCovariances(np.array([0.0, 10.0]), np.stack([np.zeros((6, 6)), np.diag(STD**2)]))


def test_the_least_certain_pose_speaks_for_the_whole_and_without_better_ten_metres_for_their_share():
    found = expected_accuracy(estimated(40.0), 0.01)
    # In a plane 68 % of the errors are within σ √(-2 ln 0.32).
    assert found.horizontal == pytest.approx(0.02 * np.sqrt(-2 * np.log(0.32)), rel=2e-3)
    assert found.vertical == pytest.approx(0.01)
    assert found.heading == pytest.approx(2e-3)
    assert found.vertical_per_10m == pytest.approx(0.005)
    assert 0.01 / np.sqrt(2.0) < found.map_thickness < 0.02


def test_ten_metres_are_as_uncertain_as_the_estimate_says():
    found = expected_accuracy(estimated(40.0, (0.1 * STD) ** 2), 0.01)
    assert found.vertical_per_10m == pytest.approx(1e-3)
    assert found.heading_per_10m == pytest.approx(2e-4)
    assert found.vertical == pytest.approx(0.01)


def test_the_map_is_as_thick_as_ranges_and_visits_scatter():
    none = np.empty(0)
    visits = Revisits(0.024, 0.01, 0.05, 100, none, none, none)
    found = expected_accuracy(estimated(40.0), 0.01, visits)
    # 10 mm of noise at all angles are 7 mm across; visits that are 24 mm apart err by 17 mm each.
    assert found.map_thickness == pytest.approx(np.hypot(0.01, 0.024) / np.sqrt(2.0))


def test_of_a_short_path_ten_metres_are_the_whole():
    found = expected_accuracy(estimated(4.0), 0.01)
    assert found.vertical_per_10m == found.vertical


def test_without_covariances_nothing_is_expected():
    assert expected_accuracy(replace(estimated(4.0), covariances=None), 0.01) is None
