# SPDX-License-Identifier: MIT OR Apache-2.0
"""NEES of errors that are drawn from what they are said to be."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.covariances import levelled_covariances
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.nees import (
    nees,
    nees_bounds,
    pose_errors_from,
    pose_errors_since,
)

RNG = np.random.default_rng(3)


def trajectory():
    times = np.linspace(0.0, 10.0, 101)
    positions = np.stack([times, np.sin(times), 0.1 * times], axis=1)
    return Trajectory(times, positions, geometry.exp(0.2 * np.sin(positions)))


def test_errors_drawn_from_their_covariance_have_their_dimension_as_mean():
    factor = RNG.normal(size=(6, 6))
    covariance = factor @ factor.T
    errors = RNG.normal(size=(4000, 6)) @ factor.T
    mean = nees(errors, np.tile(covariance, (4000, 1, 1))).mean()
    low, high = nees_bounds(4000, 6)
    # Three times as wide as 95 %.
    assert 6 - 3 * (6 - low) < mean < 6 + 3 * (high - 6)


def test_bounds_are_those_of_the_tables():
    """χ² with 180 degrees of freedom: 144.741 and 219.044."""
    assert nees_bounds(30, 6) == pytest.approx((144.741 / 30, 219.044 / 30), abs=1e-3)


def test_a_shifted_and_turned_copy_has_no_error():
    truth = trajectory()
    turn = geometry.exp(np.array([[0.0, 0.0, 1.3]]))
    moved = Trajectory(
        truth.times,
        geometry.rotate(turn, truth.positions) + np.array([1.0, 2.0, 3.0]),
        geometry.multiply(turn, truth.quats_xyzw),
    )
    errors = pose_errors_since(0.0, moved, truth, truth.times[::10])
    assert np.abs(errors).max() < 1e-9


def test_a_frame_that_hangs_on_the_lidar_has_no_error_where_the_imu_was_thought_elsewhere():
    """The estimate begins with a wrong mount and learns the right one: only its beginning is wrong."""
    truth = trajectory()
    mount = np.array([0.2, 0.1, -0.1]), geometry.exp(np.array([0.0, 0.0, 0.4]))
    lidar = (
        geometry.compose(truth.positions[0], truth.quats_xyzw[0], mount[0]),
        geometry.multiply(truth.quats_xyzw[0], mount[1]),
    )
    turn = geometry.exp(np.array([0.0, 0.0, 1.3]))
    quats, positions = truth.quats_xyzw.copy(), truth.positions.copy()
    quats[:5] = geometry.multiply(geometry.exp(np.array([0.0, 0.0, 0.01])), quats[:5])
    moved = Trajectory(
        truth.times, geometry.rotate(turn, positions), geometry.multiply(turn, quats)
    )
    hung = geometry.rotate(turn, lidar[0]), geometry.multiply(turn, lidar[1])
    errors = pose_errors_from(hung, lidar, moved, truth, truth.times[::10])
    assert errors[0, 2] == pytest.approx(0.01)
    assert np.abs(errors[1:]).max() < 1e-9
    since = pose_errors_since(0.0, moved, truth, truth.times[::10])
    assert since[-1, 2] == pytest.approx(-0.01)


def test_a_tilted_map_is_as_wrong_as_its_covariance_says():
    truth = trajectory()
    tilt = np.array([[1e-4, 0.0, 0.0]])
    moved = Trajectory(
        truth.times,
        geometry.rotate(geometry.exp(tilt), truth.positions),
        geometry.multiply(geometry.exp(tilt), truth.quats_xyzw),
    )
    errors = pose_errors_since(0.0, moved, truth, truth.times[::10])
    small = np.tile(1e-14 * np.eye(6), (11, 1, 1))
    doubt = levelled_covariances(small, truth.positions[::10], np.array([1e-4, 1e-4]))
    assert nees(errors, doubt) == pytest.approx(np.ones(11), rel=0.05)
