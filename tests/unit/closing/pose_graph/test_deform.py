# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory
from bentwing.closing.pose_graph import deform_trajectory

RATE = 100.0


@pytest.fixture
def flight():
    """Half a minute of smooth flight with a spinning IMU."""
    t = np.arange(0.0, 30.0, 1 / RATE)
    positions = np.stack([10 * np.sin(0.3 * t), 8 * np.cos(0.2 * t), 1 + 0.1 * t], axis=1)
    spin = geometry.exp(np.stack([0 * t, 0 * t, 6 * t], axis=1))
    return Trajectory(t, positions, spin)


@pytest.fixture
def nodes(flight):
    """Every 1.5 s, between samples, a pose that is off by up to a metre and a third of a turn."""
    rng = np.random.default_rng(1)
    times = np.arange(0.7531, 29.0, 1.5)
    p, q = flight.interpolate(times)
    turns = np.cumsum(rng.normal(scale=0.15, size=(len(times), 3)), axis=0)
    shifts = np.cumsum(rng.normal(scale=0.1, size=(len(times), 3)), axis=0)
    return times, p + shifts, geometry.multiply(geometry.exp(turns), q)


def changes(flight, bent):
    """Shift (N, 3) and turn (N, 4) of every sample."""
    turns = geometry.multiply(bent.quats_xyzw, geometry.inverse(flight.quats_xyzw))
    return bent.positions - flight.positions, turns


def test_the_trajectory_passes_through_the_nodes(flight, nodes):
    times, positions, quats = nodes
    dense = Trajectory(
        np.union1d(flight.times, times), *flight.interpolate(np.union1d(flight.times, times))
    )
    p, q = deform_trajectory(dense, *nodes).interpolate(times)
    np.testing.assert_allclose(p, positions, atol=1e-9)
    assert np.abs(geometry.log(geometry.multiply(geometry.inverse(q), quats))).max() < 1e-6


def test_neither_position_nor_rotation_has_a_step_or_a_kink(flight, nodes):
    """Rates of the change differ from sample to sample by no more than a bound on its curvature.

    A kink at a node would change the rate by about a shift of 0.1 m, or a turn of 0.15 rad, per
    1.5 s within one sample; a step by a hundred times that.
    """
    _, turns = changes(flight, bent := deform_trajectory(flight, *nodes))
    steps = geometry.log(geometry.multiply(turns[1:], geometry.inverse(turns[:-1])))
    assert np.abs(np.diff(steps * RATE, axis=0)).max() < 0.02
    acceleration = np.diff(bent.positions, n=2, axis=0) * RATE**2
    assert np.linalg.norm(acceleration, axis=1).max() < 6.0


def test_a_common_motion_of_all_nodes_moves_the_trajectory_rigidly(flight):
    times = np.arange(0.5, 29.0, 2.0)
    p, q = flight.interpolate(times)
    turn, shift = geometry.exp(np.array([0.3, -0.5, 1.0])), np.array([5.0, -3.0, 2.0])
    bent = deform_trajectory(
        flight, times, geometry.rotate(turn, p) + shift, geometry.multiply(turn, q)
    )
    expected = geometry.rotate(turn, flight.positions) + shift
    np.testing.assert_allclose(bent.positions, expected, atol=1e-9)


def test_nodes_that_are_where_they_were_change_nothing(flight):
    times = np.array([3.0, 11.0, 12.5])
    bent = deform_trajectory(flight, times, *flight.interpolate(times))
    np.testing.assert_allclose(bent.positions, flight.positions, atol=1e-12)


def test_one_node_moves_everything_alike(flight):
    p, q = flight.interpolate(np.array([4.0]))
    bent = deform_trajectory(flight, np.array([4.0]), p + 1.0, q)
    np.testing.assert_allclose(bent.positions, flight.positions + 1.0, atol=1e-9)


@pytest.mark.parametrize("times", [[2.0, 1.0], [2.0, 2.0]])
def test_times_that_do_not_increase_are_refused(flight, times):
    with pytest.raises(ValueError, match="times: must increase, element 1"):
        deform_trajectory(
            flight, np.array(times), np.zeros((2, 3)), np.tile([0, 0, 0, 1.0], (2, 1))
        )


def test_a_time_outside_the_trajectory_is_refused(flight):
    with pytest.raises(ValueError, match="outside the trajectory"):
        deform_trajectory(flight, np.array([31.0]), np.zeros((1, 3)), np.array([[0, 0, 0, 1.0]]))
