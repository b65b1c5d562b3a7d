# SPDX-License-Identifier: MIT OR Apache-2.0
"""The Kalman filter live: the same result as offline, and a pose at any time."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from bentwing import Odometry
from bentwing.odometry import Kalman
from bentwing.odometry.kalman import KalmanSettings
from bentwing.recording import ImuBatch
from bentwing.recording.preprocess import preprocess

SETTINGS = KalmanSettings(rehearsal=4.0)


@pytest.fixture(scope="module")
def offline(turning):
    engine = Kalman(turning.payload, SETTINGS)
    for batch in preprocess(turning.batches, turning.payload, Counter()):
        engine.feed(batch)
    return engine.result()


@pytest.fixture(scope="module")
def flown(turning):
    """An odometry that was fed in pieces, what it said meanwhile, and its result."""
    said = []
    with Odometry(turning.payload, estimator="kalman", settings=SETTINGS) as odometry:
        for i, piece in enumerate(turning.pieces):
            odometry.feed(piece)
            if isinstance(piece, ImuBatch) and i % 10 == 0:
                assert odometry.wait(60.0)
                if odometry.status != "waiting":
                    said.append((odometry.pose(), odometry.status))
        cloud = odometry.map_points()
        final = odometry.finish()
    return said, cloud, final


def test_a_replay_in_pieces_gives_the_bytes_of_the_offline_estimate(flown, offline, all_bytes):
    assert all_bytes(flown[2]) == all_bytes(offline)


def test_poses_are_young_and_near_the_final_ones(flown):
    said, _, final = flown
    times = np.array([pose.time for pose, _ in said])
    inside = (times > 6.0) & (times <= final.trajectory.times[-1])
    assert inside.sum() > 20
    positions, _ = final.trajectory.interpolate(times[inside])
    found = np.array([pose.position for pose, _ in said])[inside]
    assert np.linalg.norm(found - positions, axis=1).max() < 0.05
    assert max(pose.predicted for pose, _ in said) < 0.35
    assert {status for _, status in said} >= {"initializing"}


def test_the_map_has_points_of_the_room(flown):
    _, cloud, _ = flown
    assert len(cloud) > 5000
    assert np.abs(cloud).max() < 30.0


def test_rings_of_another_shape_are_refused(turning):
    with (
        Odometry(turning.payload, estimator="kalman") as odometry,
        pytest.raises(ValueError, match="rings: expected shape"),
    ):
        odometry.add_points(np.ones((3, 3)), np.arange(3.0), [1, 2])
