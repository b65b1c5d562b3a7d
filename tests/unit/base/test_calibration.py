# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from bentwing import _core
from bentwing.base import geometry
from bentwing.base.calibration import Calibration
from bentwing.base.inertial_unit import InertialUnit
from bentwing.base.mount import FixedMount, MotorErrors, MotorMount, Pose
from bentwing.base.plain import plain
from bentwing.base.range_bias import RangeBias
from bentwing.odometry.core_states import core_globals

POSE = Pose(np.array([0.03, -0.01, 0.05]), geometry.exp(np.array([0.1, -0.2, 0.3])))
BEHIND = Pose(np.array([0.0, 0.02, -0.07]), geometry.exp(np.array([1.5, 0.1, 0.0])))
MOTOR = MotorMount(POSE, np.array([0.0, 0.6, 0.8]), 0.25, BEHIND)
WOBBLE = 1e-3 * np.arange(-3.0, 5.0).reshape(2, 4)
ASKEW = replace(MOTOR, errors=MotorErrors(np.array([2e-3, -1e-3]), WOBBLE))
MOUNTS = [FixedMount(POSE), MOTOR, ASKEW]


def calibration(mount):
    vectors = np.array([0.01, 0.0, -0.02]), np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.0, 9.81])
    return Calibration(0.002, mount, *vectors, std={"latency": [1e-5]})


@pytest.mark.parametrize("latency_read", [0.0, 0.9])
@pytest.mark.parametrize("mount", MOUNTS)
def test_a_calibration_is_read_from_json_bit_for_bit(mount, latency_read):
    given = replace(calibration(mount), latency_read=latency_read)
    written = json.dumps(plain(given))
    found = Calibration.from_json(json.loads(written))
    assert type(found.mount) is type(mount)
    assert (found.latency, found.latency_read) == (given.latency, given.latency_read)
    assert json.dumps(found.to_json()) == written


def test_the_latency_in_json_is_that_of_the_recordings_stamps():
    assert replace(calibration(MOTOR), latency_read=0.9).to_json()["latency"] == 0.902


def test_a_calibration_in_the_run_json_of_an_earlier_version_is_read():
    def earlier(pose):
        return {"translation": pose.translation.tolist(), "quat_xyzw": pose.quaternion.tolist()}

    motor = {
        "T_imu_motor": earlier(POSE),
        "axis": [0.0, 0.6, 0.8],
        "encoder_zero": 0.25,
        "T_motor_lidar": earlier(BEHIND),
    }
    for old, mount in zip([{"T_imu_lidar": earlier(POSE)}, motor], MOUNTS[:2], strict=True):
        now = calibration(mount).to_json()
        without = {k: v for k, v in now.items() if k not in {"latency_left", "latency_read"}}
        assert Calibration.from_json({**without, "mount": old}).to_json() == now


def test_a_unit_is_read_from_json_bit_for_bit_and_one_of_an_earlier_version_is_perfect():
    unit = InertialUnit(*np.random.default_rng(4).normal(size=(3, 3, 3)), np.arange(3.0), 1)
    given = replace(calibration(MOTOR), unit=unit)
    written = json.loads(json.dumps(plain(given)))
    assert Calibration.from_json(written).unit == unit
    del written["unit"]
    assert Calibration.from_json(written).unit == InertialUnit()


@pytest.mark.parametrize("mount", [MOTOR, ASKEW])
def test_a_zero_behind_the_motor_leaves_the_lidar_where_it_is(mount):
    moved = mount.with_zero_behind_motor()
    assert moved.encoder_zero == 0.0
    for angle in (-2.0, 0.0, 0.7):
        expected, found = mount.lidar_at(angle), moved.lidar_at(angle)
        np.testing.assert_allclose(found.matrix, expected.matrix, rtol=0, atol=1e-15)


def test_the_lidar_is_behind_the_motor_at_the_angle_beyond_the_zero():
    turn = np.eye(4)
    turn[:3, :3] = geometry.to_matrices(geometry.exp(MOTOR.axis * (0.5 + 0.25)))
    expected = POSE.matrix @ turn @ BEHIND.matrix
    np.testing.assert_allclose(MOTOR.lidar_at(0.5).matrix, expected, rtol=0, atol=1e-15)


def test_a_motor_that_leans_and_whose_encoder_errs_turns_the_lidar_as_the_core_says():
    at_rest = _core.Samples(0.0, 1.0, np.zeros((2, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (2, 1)))
    slow = core_globals(calibration(ASKEW))
    points = np.vstack([np.zeros(3), np.eye(3)])
    for angle in (-2.0, 0.0, 0.7):
        times, angles = np.full(4, 0.5), np.full(4, angle)
        placed = at_rest.place(points, times, angles, slow, threads=1)
        pose = ASKEW.lidar_at(angle)
        expected = points @ pose.R.T + pose.translation
        np.testing.assert_allclose(placed, expected, rtol=0, atol=1e-12)
        assert np.abs(pose.R - MOTOR.lidar_at(angle).R).max() > 1e-3


ZERO = np.zeros(3)
DRIFTING = Calibration(
    2e-3,
    FixedMount(Pose(ZERO, np.array([0.0, 0.0, 0.0, 1.0]))),
    ZERO,
    ZERO,
    ZERO,
    latency_rate=1e-4,
    latency_epoch=20.0,
)


def test_a_drifting_clock_is_late_by_more_and_more():
    stamps = np.array([20.0, 30.0])
    np.testing.assert_allclose(
        DRIFTING.measured(stamps), [20.0 - 2e-3, 30.0 - 3e-3], rtol=0, atol=1e-12
    )


def test_another_epoch_means_the_same():
    stamps = np.linspace(0.0, 100.0, 7)
    moved = DRIFTING.with_epoch(55.0)
    assert moved.latency == pytest.approx(5.5e-3)
    np.testing.assert_allclose(
        moved.measured(stamps), DRIFTING.measured(stamps), rtol=0, atol=1e-12
    )


def test_a_clock_without_drift_takes_the_latency_off_to_the_bit():
    stamps = np.random.default_rng(1).uniform(0.0, 1e4, 100)
    steady = replace(DRIFTING, latency_rate=0.0)
    assert np.array_equal(steady.measured(stamps), stamps - 2e-3)


def test_the_drift_is_kept_in_the_record_and_runs_without_it_are_read():
    described = DRIFTING.to_json()
    assert Calibration.from_json(described) == DRIFTING
    del described["latency_rate"], described["latency_epoch"]
    assert Calibration.from_json(described).latency_rate == 0.0


def test_ranges_are_read_from_json_and_are_right_in_runs_that_do_not_have_them():
    given = replace(calibration(MOTOR), ranges=RangeBias(-0.021, 4e-4))
    written = json.loads(json.dumps(plain(given)))
    assert Calibration.from_json(written).ranges == given.ranges
    del written["ranges"]
    assert Calibration.from_json(written).ranges == RangeBias()
