# SPDX-License-Identifier: MIT OR Apache-2.0
"""The Kalman filter live: the same result as offline, and a pose at any time."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing import Odometry
from bentwing.odometry.kalman import KalmanSettings
from support.live import fly, offline

SETTINGS = KalmanSettings(rehearsal=4.0)


@pytest.fixture(scope="module")
def flown(turning):
    return fly(turning, "kalman", SETTINGS)


def test_a_replay_in_pieces_gives_the_bytes_of_the_offline_estimate(flown, turning, all_bytes):
    assert all_bytes(flown.final) == all_bytes(offline(turning, "kalman", SETTINGS))


def test_poses_are_young_and_near_the_final_ones(flown):
    said, final = flown.said, flown.final
    times = np.array([pose.time for pose, _ in said])
    inside = (times > 6.0) & (times <= final.trajectory.times[-1])
    assert inside.sum() > 20
    positions, _ = final.trajectory.interpolate(times[inside])
    found = np.array([pose.position for pose, _ in said])[inside]
    assert np.linalg.norm(found - positions, axis=1).max() < 0.05
    assert max(pose.predicted for pose, _ in said) < 0.35
    assert {status for _, status in said} >= {"initializing"}


def test_the_map_has_points_of_the_room(flown):
    cloud = flown.cloud
    assert len(cloud) > 5000
    assert np.abs(cloud).max() < 30.0


def test_rings_of_another_shape_are_refused(turning):
    with (
        Odometry(turning.payload, estimator="kalman") as odometry,
        pytest.raises(ValueError, match="rings: expected shape"),
    ):
        odometry.add_points(np.ones((3, 3)), np.arange(3.0), [1, 2])
