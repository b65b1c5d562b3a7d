# SPDX-License-Identifier: MIT OR Apache-2.0
"""NDT odometry live: the same result as offline, and a pose at any time."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bentwing import Odometry
from bentwing.odometry.ndt import NdtSettings
from bentwing.recording import LidarBatch
from support.live import fly, offline

SETTINGS = NdtSettings(max_points=1000)
LENGTH = 9.0


@pytest.fixture(scope="module")
def fixed(simulated, read_flight):
    """The first seconds of a flight with a fixed lidar."""
    return read_flight(simulated("office", 22.0, head="vlp16-fixed"), LENGTH, 3)


def estimate(flight, payload=None):
    return offline(flight, "ndt", SETTINGS, payload)


@pytest.fixture(scope="module")
def flown(fixed):
    return fly(fixed, "ndt", SETTINGS)


def test_a_replay_in_pieces_gives_the_bytes_of_the_offline_estimate(flown, fixed, all_bytes):
    assert all_bytes(flown.final) == all_bytes(estimate(fixed))


def test_a_motor_turned_lidar_gives_the_same_bytes(turning, all_bytes):
    with Odometry(turning.payload, estimator="ndt", settings=SETTINGS) as odometry:
        for batch in turning.batches:
            odometry.feed(batch)
        assert all_bytes(odometry.finish()) == all_bytes(estimate(turning))


def test_poses_are_young_and_near_the_final_ones(flown):
    """A scan, the part of the next one that is there, and the piece under way.

    Scans are known to a centimetre or two, and a velocity from three of them to 10 cm/s.
    """
    said, final = flown.said, flown.final
    times = np.array([pose.time for pose, _ in said])
    assert max(pose.predicted for pose, _ in said) < 0.25
    inside = (times > 2.0) & (times <= final.trajectory.times[-1])
    assert inside.sum() > 20
    positions, _ = final.trajectory.interpolate(times[inside])
    found = np.array([pose.position for pose, _ in said])[inside]
    errors = np.linalg.norm(found - positions, axis=1)
    assert errors.max() < 0.05


def test_the_vertical_is_learned_in_the_first_ten_seconds(flown):
    said = flown.said
    assert said[0][0].time < 1.0
    assert {status for _, status in said} == {"initializing"}


def test_the_map_has_points_of_the_room(flown):
    cloud = flown.cloud
    assert len(cloud) > 3000
    assert np.abs(cloud).max() < 30.0


def test_what_is_known_on_the_way_is_the_beginning_of_the_result(flown):
    """But for the last scans, which go on straight until the next one comes."""
    halfway, final = flown.halfway, flown.final
    positions, _ = final.trajectory.interpolate(halfway.trajectory.times[:-50])
    assert np.abs(halfway.trajectory.positions[:-50] - positions).max() < 0.01


def test_where_the_place_is_lost_a_new_map_begins(fixed):
    """For two seconds the lidar sees what is 60 m higher; then the room is a new one."""
    replaced = []
    with Odometry(fixed.payload, estimator="ndt", settings=SETTINGS) as odometry:
        for piece in fixed.pieces:
            if isinstance(piece, LidarBatch) and 5.0 < piece.times[0] < 7.0:
                piece = replace(piece, points=piece.points + np.array([0.0, 0.0, 60.0]))
            odometry.feed(piece)
            odometry.wait(60.0)
            if (update := odometry.new_points()).replaces:
                replaced.append(odometry.estimate().windows[-1].time)
                assert len(update.points)
        final = odometry.finish()
    assert final.breaks
    assert all(broken.sensor == "scan" for broken in final.breaks)
    assert len(replaced) == len(final.segments) == len(final.breaks) + 1
    assert "its place relative to what came before is a guess" in final.warnings[-1]


def test_a_lidar_alone_is_followed_and_predicted_at_constant_velocity(fixed, all_bytes):
    payload = fixed.payload.model_copy(update={"imu": None, "T_imu_lidar": None})
    statuses = set()
    with Odometry(payload, estimator="ndt", settings=SETTINGS) as odometry:
        for piece in fixed.pieces:
            if isinstance(piece, LidarBatch):
                odometry.feed(piece)
                odometry.wait(60.0)
                statuses.add(odometry.status)
        newest = odometry.pose()
        later = odometry.pose(at=newest.time + 0.1)
        final = odometry.finish()
    assert later.position == pytest.approx(newest.position + 0.1 * newest.velocity, abs=1e-3)
    assert "tracking" in statuses
    assert "initializing" not in statuses
    lidar = [b for b in fixed.batches if isinstance(b, LidarBatch)]
    alone = SimpleNamespace(payload=payload, batches=lidar)
    assert all_bytes(final) == all_bytes(estimate(alone))
