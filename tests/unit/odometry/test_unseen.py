# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.calibration import Calibration
from bentwing.base.covariances import PoseCovariances
from bentwing.base.inertial_unit import InertialUnit
from bentwing.base.mount import FixedMount, Pose
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.nees import pose_errors_since
from bentwing.odometry.unseen import RANGE_SCALE, Unseen, frame_std, with_frame
from bentwing.recording.sections.imu import Imu

IMU = Imu()
STATED = IMU.errors_expected["gyro_misalignment"]
CALIBRATION = Calibration(
    0.0, FixedMount(Pose.identity()), np.zeros(3), np.zeros(3), np.array([0.0, 0.0, 9.81])
)


def path(n=21):
    """A curve of some metres with all kinds of attitudes."""
    times = np.linspace(0.0, 10.0, n)
    positions = np.stack([times, 3 * np.sin(0.3 * times), 0.2 * times], axis=1)
    turns = np.stack([0.3 * np.sin(times), 0.2 * np.cos(times), 0.7 * times], axis=1)
    return Trajectory(times, positions, geometry.exp(turns))


def added(unseen, trajectory):
    nothing = PoseCovariances(trajectory.times, np.zeros((len(trajectory.times), 6, 6)))
    return unseen.covariances(nothing, trajectory).matrices


def outer(errors):
    return errors[:, :, None] * errors[:, None, :]


@pytest.mark.parametrize("axis", range(3))
def test_a_frame_that_is_turned_makes_the_errors_that_a_comparison_finds(axis):
    truth, size = path(), 1e-5
    turn = geometry.exp(size * np.eye(3)[axis])
    turned = replace(truth, quats_xyzw=geometry.multiply(truth.quats_xyzw, turn))
    errors = pose_errors_since(0.0, turned, truth, truth.times) / size
    columns = np.stack([added(Unseen(frame=1.0), truth)[:, i, i] for i in range(6)], axis=1)
    others = [
        pose_errors_since(
            0.0,
            replace(
                truth,
                quats_xyzw=geometry.multiply(truth.quats_xyzw, geometry.exp(size * np.eye(3)[k])),
            ),
            truth,
            truth.times,
        )
        / size
        for k in range(3)
        if k != axis
    ]
    expected = errors**2 + sum(e**2 for e in others) + (RANGE_SCALE * away_of(truth)) ** 2
    # To first order; turns of 1e-5 rad have second ones of 1e-5 of them.
    assert columns == pytest.approx(expected, rel=1e-3, abs=1e-3)


def away_of(trajectory):
    away = np.zeros((len(trajectory.times), 6))
    away[:, 3:] = trajectory.positions - trajectory.positions[0]
    return away


def test_ranges_of_another_scale_err_along_the_way_from_the_first_pose():
    truth = path()
    assert added(Unseen(), truth) == pytest.approx(outer(RANGE_SCALE * away_of(truth)), abs=1e-18)


def test_what_an_accelerometer_errs_by_tilts_the_map_of_a_head_that_does_not_turn():
    still = path()
    still = replace(still, quats_xyzw=np.tile([0.0, 0.0, 0.0, 1.0], (len(still.times), 1)))
    tilt = 1e-3
    found = added(Unseen(tilt=tilt), still) - added(Unseen(), still)
    errors = []
    for axis in np.eye(3)[:2]:
        away = away_of(still)[:, 3:]
        errors.append(np.hstack([np.tile(axis, (len(away), 1)), np.cross(axis, away)]))
    assert found == pytest.approx(tilt**2 * (outer(errors[0]) + outer(errors[1])), abs=1e-15)


def test_a_head_that_turns_averages_what_its_accelerometer_errs_by():
    times = np.linspace(0.0, 10.0, 201)[:-1]
    turns = np.stack([0 * times, 2 * np.pi * times, 0 * times], axis=1)
    spun = Trajectory(times, np.zeros((len(times), 3)), geometry.exp(turns))
    found = added(Unseen(tilt=1.0), spun)
    # Only a force along the axis of the spin, y, is not averaged: the map leans about x.
    assert np.abs(found[:, 1, 1]).max() < 1e-20
    assert found[:, 0, 0] == pytest.approx(1.0)


def test_poses_in_a_map_have_its_scale_and_heading():
    truth = path()
    found = added(Unseen(frame=0.01, tilt=0.1, slope=0.1, place=0.002, in_map=True), truth)
    expected = np.diag([1e-4, 1e-4, 1e-4, 4e-6, 4e-6, 4e-6])
    assert found == pytest.approx(np.broadcast_to(expected, found.shape), abs=1e-12)


def test_ten_metres_later_only_what_came_since_counts():
    times = np.arange(0.0, 31.0)
    straight = Trajectory(
        times,
        np.stack([times, 0 * times, 0 * times], axis=1),
        np.tile([0.0, 0.0, 0.0, 1.0], (31, 1)),
    )
    found = Unseen().short(times, straight)
    assert len(found) == 21
    assert found[:, 3, 3] == pytest.approx((10 * RANGE_SCALE) ** 2)


def unit(size, rng):
    """A unit whose axes lean by so much, and how well all of its entries are known."""
    gyro, accel = rng.normal(0.0, size, (2, 3, 3))
    std = {"gyro_misalignment": [1e-5] * 3, "accel_misalignment": [1e-5] * 6}
    return replace(CALIBRATION, unit=InertialUnit(gyro=gyro, accel=accel)), std


def test_a_unit_that_is_seen_to_lean_has_a_frame_as_uncertain():
    rng = np.random.default_rng(5)
    stds = {}
    for size in (0.0, 0.002, 0.006):
        found = [frame_std(*unit(size, rng), IMU) for _ in range(50)]
        stds[size] = np.sqrt(np.mean(np.square(found)))
    assert stds[0.0] < 1e-3
    for size in (0.002, 0.006):
        assert 0.5 * size < stds[size] < 1.2 * size


def test_what_is_not_seen_of_a_unit_does_not_count():
    calibration, _ = unit(0.006, np.random.default_rng(5))
    unknown = {"gyro_misalignment": [STATED] * 3, "accel_misalignment": [STATED] * 6}
    usual = frame_std(CALIBRATION, {}, IMU)
    assert frame_std(calibration, unknown, IMU) == usual
    assert 0.0 < usual < 0.3 * STATED


def test_without_an_imu_the_frame_is_that_of_the_lidar():
    assert frame_std(CALIBRATION, {}, None) == 0.0


def test_the_mount_is_as_uncertain_as_the_frame():
    std = {"latency": [1e-4], "extrinsic_rotation": [3e-3, 0.0, 1e-3]}
    assert with_frame(std, 4e-3)["extrinsic_rotation"] == pytest.approx(
        [5e-3, 4e-3, 4.123e-3], rel=1e-3
    )
    assert with_frame(std, 4e-3)["latency"] == [1e-4]
