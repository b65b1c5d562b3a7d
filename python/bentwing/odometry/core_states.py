# SPDX-License-Identifier: MIT OR Apache-2.0
"""Calibrations and trajectories as the compiled core takes and returns them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.base.inertial_unit import InertialUnit
from bentwing.base.mount import FixedMount, MotorErrors, MotorMount, Mount, Pose
from bentwing.base.range_bias import RangeBias

if TYPE_CHECKING:
    from bentwing.base.calibration import Calibration
    from bentwing.base.trajectory import Trajectory

# Stamps written to the nanosecond are this uniform, s; a missing sample is not.
UNIFORM_WITHIN = 1e-4


def core_globals(calibration: Calibration) -> _core.Globals:
    """Return the slow states of a calibration."""
    mount, unit = calibration.mount, calibration.unit
    names = (
        "latency", "latency_rate", "latency_epoch", "gyro_bias", "accel_bias", "gravity",
    )  # fmt: skip
    slow = {name: getattr(calibration, name) for name in names}
    slow["ranges"] = [calibration.ranges.offset, calibration.ranges.grazing]
    slow["unit"] = (unit.gyro, unit.g_sensitivity, unit.accel, unit.reference, unit.main_axis)
    if isinstance(mount, FixedMount):
        return _core.Globals(core_pose(mount.T_imu_lidar), **slow)
    return _core.Globals(
        core_pose(mount.T_imu_motor),
        **slow,
        motor_axis=mount.axis,
        encoder_zero=mount.encoder_zero,
        T_motor_lidar=core_pose(mount.T_motor_lidar),
        motor_errors=(mount.errors.eccentricity.tolist(), mount.errors.wobble.tolist()),
    )


def refined(described: Calibration, slow: _core.Globals) -> Calibration:
    """Return a calibration with clock, mount, unit and ranges of the slow states; gravity stays."""
    return replace(
        described,
        latency=slow.latency,
        latency_rate=slow.latency_rate,
        latency_epoch=slow.latency_epoch,
        mount=_refined_mount(described.mount, slow),
        gyro_bias=slow.gyro_bias,
        accel_bias=slow.accel_bias,
        unit=unit_of(slow),
        ranges=RangeBias(*slow.ranges),
    )


def unit_of(slow: _core.Globals) -> InertialUnit:
    """Return how the IMU answers by the slow states."""
    gyro, g_sensitivity, accel, reference, main_axis = slow.unit
    matrices = np.array(gyro), np.array(g_sensitivity), np.array(accel)
    return InertialUnit(*matrices, np.array(reference), main_axis)


def _refined_mount(described: Mount, slow: _core.Globals) -> Mount:
    """Return the mount with the transforms of the slow states; a motor keeps its axis."""
    base = Pose(slow.base_translation, slow.base_quat_xyzw)
    translation, quat = slow.motor_lidar_translation, slow.motor_lidar_quat_xyzw
    errors = slow.motor_errors
    if isinstance(described, FixedMount) or translation is None or quat is None or errors is None:
        return FixedMount(base)
    eccentricity, wobble = (np.array(values) for values in errors)
    lidar, turns = Pose(translation, quat), MotorErrors(eccentricity, wobble)
    return MotorMount(base, described.axis, slow.encoder_zero, lidar, turns)


def core_samples(trajectory: Trajectory) -> _core.Samples:
    """Return the samples of a trajectory.

    Raises
    ------
    ValueError
        If the trajectory has fewer than two poses or not the same time between all of them.
    """
    times = trajectory.times
    if len(times) < 2:
        msg = f"trajectory: expected at least two poses, got {len(times)}"
        raise ValueError(msg)
    uniform = np.linspace(times[0], times[-1], len(times))
    off = np.abs(times - uniform)
    if off.max() > UNIFORM_WITHIN:
        worst = int(np.argmax(off))
        msg = (
            "trajectory: expected the same time between all poses, "
            f"but pose {worst} is {off[worst]:.4f} s off; resample it"
        )
        raise ValueError(msg)
    return _core.Samples(
        float(times[0]),
        float((times[-1] - times[0]) / (len(times) - 1)),
        np.ascontiguousarray(trajectory.positions),
        np.ascontiguousarray(trajectory.quats_xyzw),
    )


def core_pose(pose: Pose) -> tuple[list[float], list[float]]:
    """Return translation and quaternion of a pose."""
    return pose.translation.tolist(), pose.quaternion.tolist()
