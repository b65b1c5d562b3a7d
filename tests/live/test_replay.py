# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is fed live ends as it does offline, and is known on the way."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from bentwing import Odometry
from bentwing.base import geometry
from bentwing.odometry.continuous.slow_states import INITIAL_STD


def test_a_replay_in_pieces_gives_the_bytes_of_the_offline_estimate(flown, estimate, all_bytes):
    assert all_bytes(flown.final) == all_bytes(estimate)


def test_a_replay_at_full_speed_gives_the_same_bytes(new, flight, estimate, all_bytes):
    odometry = new()
    for batch in flight.batches:
        odometry.feed(batch)
    assert all_bytes(odometry.finish()) == all_bytes(estimate)


@pytest.mark.slow
def test_a_motor_turned_lidar_gives_the_same_bytes(
    simulated, all_bytes, offline, read_flight, quick
):
    flight = read_flight(simulated("office", 22.0, head="vlp16-motor"), length=14.0, thinning=10)
    assert flight.payload.encoder is not None
    with Odometry(flight.payload, settings=quick, threads=1, max_lag=np.inf) as odometry:
        for piece in flight.pieces:
            odometry.feed(piece)
        assert all_bytes(odometry.finish()) == all_bytes(offline(flight))
        assert len(odometry.map_points()) > 1000


@pytest.mark.slow
def test_a_start_in_motion_gives_the_same_bytes(simulated, all_bytes, offline, read_flight, quick):
    flight = read_flight(simulated("office", 22.0, events=("motion-start",)))
    with Odometry(flight.payload, settings=quick, threads=1, max_lag=np.inf) as odometry:
        for piece in flight.pieces:
            odometry.feed(piece)
        assert all_bytes(odometry.finish()) == all_bytes(offline(flight))


def test_the_status_goes_from_waiting_over_initializing_to_tracking(new, flown):
    assert new().status == "waiting"
    statuses = [status for _, status in flown.poses]
    assert statuses[0] == "initializing"
    assert statuses[-1] in {"tracking", "degenerate"}
    known = [status != "initializing" for status in statuses]
    assert known == sorted(known)


def test_the_first_pose_comes_with_the_six_seconds_in_which_the_start_is_looked_for(flown):
    assert 6.0 <= flown.poses[0][0].time <= 6.3


def test_poses_stay_young(flown, quick):
    """A window of new data, the margin for latencies, and the piece under way."""
    assert max(pose.predicted for pose, _ in flown.poses) <= quick.shift + 0.1 + 0.05


def test_predicted_poses_are_near_the_final_ones(flown, quick):
    """A velocity known to 3 cm/s leads 3 cm away in a second, at most twice that in 95 %."""
    poses = [pose for pose, status in flown.poses if status != "initializing"]
    final = flown.final.trajectory
    times = np.array([p.time for p in poses])
    known = final.covers(times)
    right, quats = final.interpolate(times[known])
    errors = np.linalg.norm(np.array([p.position for p in poses])[known] - right, axis=1)
    assert np.median(errors) < 0.03 * quick.shift
    assert np.percentile(errors, 95) < 0.06 * quick.shift
    turned = geometry.multiply(
        geometry.inverse(quats), np.array([p.quat_xyzw for p in poses])[known]
    )
    errors = np.abs(geometry.log(turned)).max(axis=1)
    # In the first seconds of a spin the scale of a consumer's gyro is known to 0.5 % only, which is
    # 0.013 rad in the half second that is predicted; frozen, it would be 0.002 from the start.
    assert errors.max() < 0.02
    settled = times[known] > times[known][0] + 3.0
    assert errors[settled].max() < 0.005


def test_predicted_velocities_are_near_the_true_ones(flown, flight):
    """Seen in any frame: their lengths."""
    poses = [pose for pose, status in flown.poses if status != "initializing"]
    times = np.array([p.time for p in poses])
    before, _ = flight.truth.interpolate(times - 0.01)
    after, _ = flight.truth.interpolate(times + 0.01)
    speeds = np.linalg.norm((after - before) / 0.02, axis=1)
    errors = np.abs(np.linalg.norm([p.velocity for p in poses], axis=1) - speeds)
    assert np.percentile(errors, 95) < 0.08


def test_the_pose_steps_by_no_more_than_what_was_unknown(flown, quick):
    """At first gravity is known to 0.02 rad, which leads 0.12 m away within a window's new data and
    the margin, and half a piece; later the velocity to 3 cm/s. Twice that is allowed.
    """
    pairs = list(pairwise(flown.poses))
    steps = np.array(
        [np.linalg.norm(b.position - a.position - a.velocity * 0.005) for (a, _), (b, _) in pairs]
    )
    newer = np.array([b.predicted < a.predicted for (a, _), (b, _) in pairs])
    learned = np.array([status != "initializing" for (_, status), _ in pairs])
    assert newer.sum() >= 4
    assert steps[~newer].max() < 0.003
    unknown = 0.5 * 9.81 * INITIAL_STD["gravity"] * (quick.shift + 0.1) ** 2
    assert steps[newer & ~learned].max() < 2 * unknown
    assert steps[newer & learned].max() < 2 * 0.03 * (quick.shift + 0.1)


def test_poses_of_the_past_are_those_of_the_trajectory(flown):
    trajectory = flown.final.trajectory
    times = np.linspace(trajectory.times[0], trajectory.times[-1], 50)
    positions, quats = trajectory.interpolate(times)
    for at, position, quat in zip(times, positions, quats, strict=True):
        pose = flown.odometry.pose(at=at)
        assert pose.time == at
        assert pose.position == pytest.approx(position, abs=1e-9)
        assert abs(pose.quat_xyzw @ quat) == pytest.approx(1.0, abs=1e-12)
        assert pose.T_map_imu[:3, 3] == pytest.approx(position, abs=1e-9)


def test_the_map_has_one_point_per_voxel_on_what_was_measured(flown):
    points = flown.odometry.map_points()
    assert len(points) > 1000
    assert np.isfinite(points).all()
    voxels = np.unique(np.floor(points.astype(np.float64) / 0.1), axis=0)
    assert len(voxels) > 0.99 * len(points)  # rounded to float32 after the voxels were told apart
    update = flown.odometry.new_points()
    assert update.replaces
    assert np.array_equal(update.points, points)
    again = flown.odometry.new_points()
    assert not again.replaces
    assert len(again.points) == 0


def test_the_memory_of_the_raw_data_is_bounded(flown, quick):
    """Inertial samples since the last window, points of one window and a second."""
    state, buffer = flown.odometry._state, flown.odometry._engine.buffer
    assert len(state._imu) < 200 * 3.0
    first, last = buffer.lidar_span
    assert last - first < quick.window + quick.shift + 1.0
