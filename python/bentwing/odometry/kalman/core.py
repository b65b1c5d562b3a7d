# SPDX-License-Identifier: MIT OR Apache-2.0
"""Settings, state and covariance as the compiled core takes them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.mount import FixedMount, MotorMount, Mount, Pose
from bentwing.base.trajectory import DT
from bentwing.odometry.continuous.slow_states import WALK, initial_std
from bentwing.odometry.core_states import core_pose

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.calibration import Calibration
    from bentwing.odometry.kalman.settings import KalmanSettings
    from bentwing.odometry.start import Start
    from bentwing.recording.sections.imu import Imu
    from bentwing.recording.sections.lidar import Lidar

    Transform = tuple[list[float], list[float]]

# Places in the tangent, as `bentwing_kalman::at`.
N_STATES = 31
ROTATION, POSITION, VELOCITY = slice(0, 3), slice(3, 6), slice(6, 9)
GYRO_BIAS, ACCEL_BIAS, GRAVITY = slice(9, 12), slice(12, 15), slice(15, 17)
BASE_ROTATION, BASE_TRANSLATION = slice(17, 20), slice(20, 23)
LIDAR_ROTATION, LIDAR_TRANSLATION = slice(23, 26), slice(26, 29)
LATENCY, ENCODER_DELAY = slice(29, 30), slice(30, 31)
# What a second beginning takes over from the first.
SLOW = np.r_[9:31]
# Of the velocity at rest and in motion, m/s.
REST_SPEED, MOVING_SPEED = 0.01, 1.0
# What one feature says beside its neighbours on the same surface, whose errors it shares.
INDEPENDENCE = 0.25
# By so much the stamps of a sweep are wrong in common, s, as drivers give them.
STAMP_JITTER = 2e-4
# Features after which a voxel is known.
CELL_POINTS = 300
# Least distance between the features of an update, m.
SPACING = 0.15
# The map is kept this much beyond the reach of the lidar.
BEYOND = 1.1


@dataclass(frozen=True, slots=True)
class FilterSettings:
    """Noise as densities; lengths in m, times in s."""

    sigma: float
    gyro_noise: float
    accel_noise: float
    gyro_bias_walk: float
    accel_bias_walk: float
    rotation_walk: float
    translation_walk: float
    delay_walk: float
    voxel_size: float
    n_levels: int
    cell_points: int
    renew: bool
    reach: float
    max_features: int
    spacing: float
    max_iterations: int
    independence: float
    stamp_jitter: float
    edges: bool
    axis: list[float]
    pose_interval: float
    odometry_interval: float
    smoothing: float

    @classmethod
    def of(
        cls, settings: KalmanSettings, lidar: Lidar, imu: Imu, mount: Mount, *, renew: bool
    ) -> FilterSettings:
        """Combine settings and payload; `renew`: voxels forget what is old."""
        axis = mount.axis if isinstance(mount, MotorMount) else np.array([0.0, 0.0, 1.0])
        return cls(
            sigma=lidar.range_sigma,
            gyro_noise=imu.gyro_noise,
            accel_noise=imu.accel_noise,
            gyro_bias_walk=imu.gyro_bias_walk,
            accel_bias_walk=max(imu.accel_bias_walk, WALK["accel_bias"]),
            rotation_walk=WALK["extrinsic_rotation"],
            translation_walk=WALK["extrinsic_translation"],
            delay_walk=WALK["latency"],
            voxel_size=settings.voxel_size,
            n_levels=settings.n_levels,
            cell_points=CELL_POINTS,
            renew=renew,
            reach=BEYOND * lidar.max_range,
            max_features=settings.max_features,
            spacing=SPACING,
            max_iterations=settings.max_iterations,
            independence=INDEPENDENCE,
            stamp_jitter=STAMP_JITTER,
            edges=settings.edges,
            axis=axis.tolist(),
            pose_interval=DT,
            odometry_interval=1.0 / settings.odometry_rate,
            smoothing=settings.smoothing,
        )


@dataclass(frozen=True, slots=True)
class FilterState:
    """The state; transforms are translation and quaternion."""

    pose: Transform
    velocity: list[float]
    gyro_bias: list[float]
    accel_bias: list[float]
    gravity: list[float]
    base: Transform
    lidar: Transform
    latency: float
    encoder_delay: float


def first_state(start: Start, described: Calibration) -> FilterState:
    """Return the state at the start as payload and inertial samples have it."""
    base, lidar = _mounts(described.mount)
    return FilterState(
        pose=([0.0, 0.0, 0.0], start.quat_xyzw.tolist()),
        velocity=[0.0, 0.0, 0.0],
        gyro_bias=start.gyro_bias.tolist(),
        accel_bias=start.accel_bias.tolist(),
        gravity=described.gravity.tolist(),
        base=core_pose(base),
        lidar=core_pose(lidar),
        latency=described.latency,
        encoder_delay=0.0,
    )


def first_covariance(start: Start, mount: Mount) -> NDArray[np.float64]:
    """Return the covariance (31, 31) at the start.

    The first pose is known exactly, see `anchored`, and the doubt is in gravity's direction. Of the
    lidar behind a motor the turn about the axis and the shift along it are those of the motor before
    it, so they have none.
    """
    moving = start.static is None
    std = initial_std(moving=moving)
    covariance = np.zeros((N_STATES, N_STATES))

    def put(place: slice, value: float | NDArray[np.float64]) -> None:
        index = np.arange(N_STATES)[place]
        covariance[index, index] = np.asarray(value) ** 2

    put(VELOCITY, MOVING_SPEED if moving else REST_SPEED)
    put(GYRO_BIAS, std["gyro_bias"] if start.static is None else start.static.gyro_bias_std)
    put(ACCEL_BIAS, std["accel_bias"])
    put(GRAVITY, std["gravity"])
    put(BASE_ROTATION, std["extrinsic_rotation"])
    put(BASE_TRANSLATION, std["extrinsic_translation"])
    put(LATENCY, std["latency"])
    if isinstance(mount, MotorMount):
        across = np.eye(3) - np.outer(mount.axis, mount.axis)
        covariance[LIDAR_ROTATION, LIDAR_ROTATION] = std["motor_tilt"] ** 2 * across
        covariance[LIDAR_TRANSLATION, LIDAR_TRANSLATION] = std["motor_offset"] ** 2 * across
        put(ENCODER_DELAY, std["latency"])
    return covariance


def anchored(covariance: NDArray[np.float64], state: FilterState) -> NDArray[np.float64]:
    """Let the first views of the lidar be what the map is.

    The map is what the lidar sees from its first pose: that of the base (motor or lidar) is exact, and
    the IMU is as far from where it is said to be as the mount is wrong. With an exact IMU instead,
    the map would seem to confirm the mount it was made with:
    `δr = -R δr_base`, `δp = -δr × R t_base - R δt_base`.

    Parameters
    ----------
    covariance : (31, 31) with nothing about the pose
    """
    R = geometry.to_matrices(np.array([state.pose[1]]))[0]
    lever = R @ np.array(state.base[0])
    effect = np.eye(N_STATES)
    effect[ROTATION, BASE_ROTATION] = -R
    effect[POSITION, BASE_ROTATION] = -np.cross(lever, R, axisb=0, axisc=0)
    effect[POSITION, BASE_TRANSLATION] = -R
    return np.asarray(effect @ covariance @ effect.T)


def unlearned_delay(rate: float, mount: MotorMount, state: FilterState) -> NDArray[np.float64]:
    """Return a covariance (31, 31) to add: as if nothing were known of the encoder's delay alone.

    At a constant rate a longer delay is a turn of the motor's mount about its axis the other way. Only
    while the rate changes are they told apart, and what is seen then is compared with a map made with
    the wrong delay, which the filter believes: of that a second beginning from the same data takes the
    value and not the certainty. What both together are stays known.
    """
    quat = np.array(state.base[1])
    direction = np.zeros(N_STATES)
    direction[BASE_ROTATION] = rate * geometry.rotate(quat, mount.axis)
    direction[ENCODER_DELAY] = 1.0
    return np.asarray(initial_std(moving=False)["latency"] ** 2 * np.outer(direction, direction))


def _mounts(mount: Mount) -> tuple[Pose, Pose]:
    if isinstance(mount, FixedMount):
        return mount.T_imu_lidar, Pose.identity()
    return mount.T_imu_motor, mount.T_motor_lidar
