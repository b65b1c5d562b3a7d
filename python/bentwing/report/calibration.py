# SPDX-License-Identifier: MIT OR Apache-2.0
"""The calibration of the sensor head as a table a person can compare with a drawing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.base.calibration import STANDARD_GRAVITY, Calibration
from bentwing.base.mount import FixedMount
from bentwing.report.sections import DASH, table

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from bentwing.base.inertial_unit import InertialUnit
    from bentwing.base.mount import MotorErrors, Mount, Pose
    from bentwing.base.range_bias import RangeBias

DEGREES = 180 / np.pi
_PER_G = DEGREES * STANDARD_GRAVITY


def calibration_table(calibration: Mapping[str, Any] | None) -> str:
    """Make the table of latency, extrinsics, biases and inertial unit with their standard deviations."""
    if not calibration:
        return '<p class="none">Not recorded.</p>'
    found = Calibration.from_json(calibration)
    std = found.std
    rows = [
        _row("lidar latency, ms", [found.source_latency], std.get("latency"), 1e3, 3),
        *_rate_row(found, std.get("latency_rate")),
        *_mount_rows(found.mount, std),
        _row("gyro bias, °/s", found.gyro_bias, std.get("gyro_bias"), DEGREES, 4),
        _row("accelerometer bias, m/s²", found.accel_bias, std.get("accel_bias"), 1.0, 4),
        _row("gravity in the map, m/s²", found.gravity, None, 1.0, 4),
    ]
    rows += _unit_rows(found.unit, std)
    rows += _range_rows(found.ranges, std)
    if std.get("gravity"):
        rows.append(_row("direction of gravity, °", [0.0, 0.0], std["gravity"], DEGREES, 3))
    head = ("quantity", "estimate", "standard deviation")
    return table(head, rows, numbers=frozenset({1, 2}))


def _unit_rows(unit: InertialUnit, std: Mapping[str, list[float]]) -> list[tuple[str, str, str]]:
    """Make the rows of what the unit does wrong beside its biases, if it was estimated."""
    off_diagonal = ~np.eye(3, dtype=bool)
    leans = [unit.gyro[place] for place in unit.misalignments]
    values: dict[str, tuple[str, Iterable[float], float, int]] = {
        "gyro_scale": ("gyro scale, %", np.diag(unit.gyro), 100.0, 3),
        "gyro_misalignment": ("gyro misalignment, °", leans, DEGREES, 3),
        "g_sensitivity": ("g-sensitivity, °/s/g", unit.g_sensitivity.ravel(), _PER_G, 3),
        "accel_scale": ("accelerometer scale, %", np.diag(unit.accel), 100.0, 2),
        "accel_misalignment": (
            "accelerometer misalignment, °", unit.accel[off_diagonal], DEGREES, 2,
        ),
    }  # fmt: skip
    return [
        _row(title, found, std[name], scale, digits)
        for name, (title, found, scale, digits) in values.items()
        if name in std
    ]


def _range_rows(ranges: RangeBias, std: Mapping[str, list[float]]) -> list[tuple[str, str, str]]:
    """Make the rows of what is wrong with the ranges: of what was found or described."""
    rows = [
        ("ranges too long, mm", ranges.offset, std.get("range_offset"), 1),
        ("the same under 45°, mm per m", ranges.grazing, std.get("range_grazing"), 2),
    ]
    return [_row(name, [value], known, 1e3, n) for name, value, known, n in rows if known or value]


def _rate_row(found: Calibration, std: Sequence[float] | None) -> list[tuple[str, str, str]]:
    if std is None:
        return []
    return [_row("lidar clock against the IMU's, ppm", [found.latency_rate], std, 1e6, 1)]


def _mount_rows(mount: Mount, std: Mapping[str, list[float]]) -> list[tuple[str, str, str]]:
    base_std = std.get("extrinsic_translation"), std.get("extrinsic_rotation")
    if isinstance(mount, FixedMount):
        return _pose_rows("lidar in IMU", mount.T_imu_lidar, *base_std)
    motor_std = std.get("motor_offset"), std.get("motor_tilt")
    return [
        *_pose_rows("motor in IMU", mount.T_imu_motor, *base_std),
        _row("encoder zero, °", [mount.encoder_zero], std.get("encoder_zero"), DEGREES, 3),
        *_pose_rows("lidar in motor", mount.T_motor_lidar, *motor_std),
        *_error_rows(mount.errors, std),
    ]


def _error_rows(errors: MotorErrors, std: Mapping[str, list[float]]) -> list[tuple[str, str, str]]:
    """How the motor turns otherwise than its encoder reads."""
    rows = (
        ("encoder eccentricity, ° (cosine, sine)", errors.eccentricity, "encoder_eccentricity"),
        ("motor wobble, ° (cosine, sine, once and twice a turn, two axes)", errors.wobble.ravel(), "motor_wobble"),
    )  # fmt: skip
    return [
        _row(name, values, std.get(state), DEGREES, 3)
        for name, values, state in rows
        if values.any()
    ]


def _pose_rows(
    name: str,
    pose: Pose,
    translation_std: Sequence[float] | None,
    rotation_std: Sequence[float] | None,
) -> list[tuple[str, str, str]]:
    rotation = geometry.log(pose.quaternion)
    return [
        _row(f"{name}, mm (x, y, z)", pose.translation, translation_std, 1e3, 1),
        _row(f"{name}, rotation vector, °", rotation, rotation_std, DEGREES, 3),
    ]


def _row(
    name: str, values: Iterable[float], std: Sequence[float] | None, unit: float, digits: int
) -> tuple[str, str, str]:
    deviations = DASH if std is None else "   ".join(f"± {unit * s:.{digits}f}" for s in std)
    return name, "   ".join(f"{unit * v:.{digits}f}" for v in values), deviations
