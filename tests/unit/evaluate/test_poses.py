# SPDX-License-Identifier: MIT OR Apache-2.0
"""RTE and RRE on trajectories whose errors are known."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.density import wall_density
from bentwing.evaluate.poses import pose_errors

TIMES = np.linspace(0.0, 10.0, 101)


def straight(turn=(0.0, 0.0, 0.0), shift=(0.0, 0.0, 0.0), rate=0.0):
    """One metre a second along x of the first pose, turning at `rate` rad/s, moved as a whole."""
    quat = geometry.exp(np.array(turn))
    positions = geometry.rotate(quat, np.outer(TIMES, [1.0, 0.0, 0.0])) + np.array(shift)
    turns = geometry.exp(np.outer(TIMES, [0.0, 0.0, rate]))
    return Trajectory(TIMES, positions, geometry.multiply(quat, turns))


def test_the_first_pose_is_given():
    errors = pose_errors(straight((0.1, -0.4, 2.0), (5.0, 6.0, 7.0)), straight())
    assert errors.rte == pytest.approx(np.zeros(101), abs=1e-12)
    assert errors.rre == pytest.approx(np.zeros(101), abs=1e-7)


def test_rte_is_a_distance_and_rre_the_frobenius_norm_of_the_logarithm():
    truth = straight()
    estimate = Trajectory(TIMES, truth.positions * 1.02, straight(rate=0.01).quats_xyzw)
    errors = pose_errors(estimate, truth)
    assert errors.rte == pytest.approx(0.02 * TIMES, abs=1e-9)
    # logm(R) is the cross-product matrix of the rotation vector, twice each of its components.
    assert errors.rre == pytest.approx(np.sqrt(2.0) * 0.01 * TIMES, abs=1e-7)


def test_density_counts_the_points_on_the_wall_alone():
    rng = np.random.default_rng(3)
    wall = np.column_stack([np.full(4000, 10.0), rng.uniform(0, 2, 4000), rng.uniform(0, 1, 4000)])
    other = wall - [1.0, 0.0, 0.0]
    density = wall_density(
        np.vstack([wall, other]), 0, 10.0, limits=((0.0, 2.0), (0.0, 1.0)), cell=0.5
    )
    assert density.shape == (4, 2)
    assert density.mean() == pytest.approx(2000.0)
