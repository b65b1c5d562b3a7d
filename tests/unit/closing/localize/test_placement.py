# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.calibration import Calibration
from bentwing.base.estimate import Estimate
from bentwing.base.mount import FixedMount, Pose
from bentwing.base.trajectory import Trajectory
from bentwing.closing.localize import place_in_map
from bentwing.closing.places import Agreement, Alignment, Candidate

TIMES = np.arange(0.0, 60.0, 0.01)
PLACES = [(0.0, 20.0), (20.0, 40.0), (40.0, 60.0)]


class Place:
    def __init__(self, span):
        self.span = span


def transform(yaw, shift):
    T = np.eye(4)
    T[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    T[:3, 3] = shift
    return T


def estimate():
    positions = np.stack([TIMES, 3 * np.sin(TIMES / 9), 0.1 * TIMES], axis=1)
    quats = geometry.exp(TIMES[:, None] * np.array([0.0, 0.1, 1.0]))
    mount = FixedMount(Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])))
    calibration = Calibration(0.0, mount, np.zeros(3), np.zeros(3), np.array([0.0, 0.0, 9.81]))
    return Estimate(Trajectory(TIMES, positions, quats), calibration)


def candidate(j, T, *, n_alike=100, reason=None):
    alignment = Alignment(T, np.eye(6), np.zeros(3), n_alike)
    return Candidate(0, j, 50.0, reason, 9, alignment, Agreement(1, 1, 0, 1, n_alike, 0.0))


def placed(*candidates):
    return place_in_map(estimate(), candidates, [Place(span) for span in PLACES])


def test_an_estimate_moves_as_a_whole():
    T = transform(2.0, [5.0, -3.0, 1.0])
    found = placed(candidate(1, T))
    poses, moved = estimate().trajectory, found.estimate.trajectory
    assert np.allclose(moved.positions, poses.positions @ T[:3, :3].T + T[:3, 3])
    turned = geometry.to_matrices(moved.quats_xyzw)
    assert np.allclose(turned, T[:3, :3] @ geometry.to_matrices(poses.quats_xyzw))
    assert found.largest_deformation == 0.0


def test_without_a_recognized_place_there_is_none():
    assert placed(candidate(0, np.eye(4), reason="12 votes")) is None
    assert placed() is None


@pytest.mark.parametrize("false_at", [0, 1, 2])
def test_places_that_agree_outvote_one_that_looks_better(false_at):
    T = transform(1.0, [1.0, 2.0, 0.0])
    false = candidate(1, transform(-1.0, [9.0, 9.0, 0.0]), n_alike=500)
    candidates = [candidate(0, T), candidate(2, T)]
    candidates.insert(false_at, false)
    found = placed(*candidates)
    assert np.allclose(found.T_map_run, T)
    assert false_at not in found.supporters


def test_two_places_that_contradict_each_other_place_nothing():
    """However much better the one looks."""
    true, false = transform(1.0, [1.0, 2.0, 0.0]), transform(-1.0, [9.0, 9.0, 0.0])
    assert placed(candidate(0, true), candidate(2, false, n_alike=500)) is None


def test_a_trajectory_that_has_drifted_is_bent_to_its_places():
    """Twenty metres of way between the places are half a metre of drift, and more than is left alone."""
    first, last = transform(0.0, [0.0, 0.0, 0.0]), transform(0.01, [0.0, 0.45, 0.0])
    found = placed(candidate(0, first), candidate(2, last))
    assert found.largest_deformation > 0.3
    moved, poses = found.estimate.trajectory, estimate().trajectory
    for time, T in ((10.0, first), (50.0, last)):
        here, _ = poses.interpolate(np.array([time]))
        there, _ = moved.interpolate(np.array([time]))
        assert np.allclose(there, here @ T[:3, :3].T + T[:3, 3], atol=1e-6)
    steps = np.linalg.norm(np.diff(moved.positions, axis=0), axis=1)
    assert steps.max() < 1.1 * np.linalg.norm(np.diff(poses.positions, axis=0), axis=1).max()
