# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.calibration import Calibration
from bentwing.base.mount import FixedMount, MotorMount, Pose
from bentwing.base.trajectory import Trajectory
from bentwing.map import project as room
from bentwing.map.project import project
from bentwing.recording.batches import ImuBatch, LidarBatch

TARGET = np.array([4.0, 1.0, -0.5])
R_IMU_LIDAR = geometry.exp(np.array([0.1, -0.4, 0.9]))
T_IMU_LIDAR = np.array([0.03, 0.0, -0.05])
LATENCY = 0.004
PLACED_WITHIN = 1e-6  # m, at these rates of turn


def calibration(**changes):
    values = {
        "latency": LATENCY,
        "mount": FixedMount(Pose(T_IMU_LIDAR, R_IMU_LIDAR)),
        "gyro_bias": np.zeros(3),
        "accel_bias": np.zeros(3),
        "gravity": np.array([0, 0, 9.81]),
    }
    return Calibration(**{**values, **changes})


def trajectory():
    times = 0.01 * np.arange(101)
    turns = np.stack([0.2 * times, -0.1 * times, 5.0 * times], axis=1)
    return Trajectory(times, np.outer(times, [2.0, 0.0, 1.0]), geometry.exp(turns))


def seen_in_imu(stamps):
    positions, quats = trajectory().interpolate(stamps - LATENCY)
    return geometry.rotate(geometry.inverse(quats), TARGET - positions)


def undone(translation, quat, points):
    return geometry.rotate(geometry.inverse(quat), points - translation)


def test_a_fixed_target_seen_while_turning_is_mapped_to_one_place():
    stamps = np.linspace(LATENCY, 1.0 + LATENCY - 1e-9, 1000)
    points = undone(T_IMU_LIDAR, R_IMU_LIDAR, seen_in_imu(stamps))
    batches = [
        LidarBatch(p, t) for p, t in zip(np.split(points, 10), np.split(stamps, 10), strict=True)
    ]
    chunks = list(project(batches, trajectory(), calibration()))
    assert np.allclose(
        np.concatenate([c.points for c in chunks]), TARGET, rtol=0, atol=PLACED_WITHIN
    )
    assert np.allclose(np.concatenate([c.times for c in chunks]), stamps - LATENCY)
    assert np.allclose(
        np.concatenate([c.ranges for c in chunks]), np.linalg.norm(points, axis=1), rtol=1e-6
    )


def test_a_motor_turned_lidar_goes_through_mount_axis_and_zero():
    stamps, zero = np.linspace(0.1, 0.9, 400), 0.03
    axis = np.array([0.0, 0.6, 0.8])
    motor = Pose(np.array([0.1, 0.0, 0.2]), R_IMU_LIDAR)
    lever = Pose(np.array([0.0, 0.02, 0.0]), geometry.exp(np.array([0, 0.2, 0])))
    angles = 7.0 * stamps
    points = undone(motor.translation, motor.quaternion, seen_in_imu(stamps))
    points = geometry.rotate(geometry.exp(-(angles + zero)[:, None] * axis), points)
    points = undone(lever.translation, lever.quaternion, points)
    batch = LidarBatch(points, stamps, angles=angles)
    mount = MotorMount(motor, axis, zero, lever)
    (chunk,) = project([batch], trajectory(), calibration(mount=mount))
    assert np.allclose(chunk.points, TARGET, rtol=0, atol=PLACED_WITHIN)


def test_a_motor_without_angles_is_refused():
    batch = LidarBatch(np.ones((1, 3)), np.array([0.5]))
    pose = Pose(np.zeros(3), R_IMU_LIDAR)
    mount = MotorMount(pose, np.array([0, 0, 1.0]), 0.0, pose)
    with pytest.raises(ValueError, match="angle of every return"):
        list(project([batch], trajectory(), calibration(mount=mount)))


def test_a_trajectory_with_a_missing_pose_is_refused():
    whole = trajectory()
    kept = np.arange(101) != 40
    gapped = Trajectory(whole.times[kept], whole.positions[kept], whole.quats_xyzw[kept])
    with pytest.raises(ValueError, match="resample"):
        list(project([], gapped, calibration()))


def test_what_cannot_be_placed_is_dropped_and_counted():
    points = np.ones((5, 3))
    points[3, 1] = np.nan
    stamps = np.array([-0.5, 0.0, 0.5, 0.6, 3.0]) + LATENCY
    imu = ImuBatch(np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)))
    batch = LidarBatch(points, stamps, intensity=np.arange(5, dtype=np.float32))
    counts = {}
    (chunk,) = project([imu, batch], trajectory(), calibration(), counts=counts)
    assert chunk.intensity.tolist() == [1, 2]
    assert counts == {"map.points": 2, "map.outside_trajectory": 2, "map.not_finite": 1}


def test_what_was_seen_in_a_break_of_the_trajectory_is_dropped():
    stamps = np.array([0.1, 0.5, 0.9]) + LATENCY
    batch = LidarBatch(np.ones((3, 3)), stamps, intensity=np.arange(3, dtype=np.float32))
    segments = [(0.0, 0.4), (0.6, 1.0)]
    (chunk,) = project([batch], trajectory(), calibration(), segments=segments)
    assert chunk.intensity.tolist() == [0, 2]


def test_small_batches_are_joined_into_chunks_of_bounded_size(monkeypatch):
    monkeypatch.setattr(room, "POINTS_PER_CHUNK", 50)
    batches = [LidarBatch(np.ones((20, 3)), np.full(20, 0.01 * i)) for i in range(10)]
    sizes = [len(chunk) for chunk in project(batches, trajectory(), calibration(latency=0.0))]
    assert sizes == [60, 60, 60, 20]
