# SPDX-License-Identifier: MIT OR Apache-2.0
"""The calibration of the sensor head as a table a person can compare with a drawing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing import geometry
from bentwing.report.sections import DASH, table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


def calibration_table(calibration: Mapping[str, Any] | None) -> str:
    """Make the table of latency, extrinsics and biases with their standard deviations."""
    if not calibration:
        return '<p class="none">Not recorded.</p>'
    std = calibration.get("std") or {}
    rotation = geometry.log(np.array(calibration["T_imu_lidar_quat_xyzw"], float))
    degrees = 180 / np.pi
    rows = [
        _row("lidar latency, ms", [calibration["latency"]], std.get("latency"), 1e3, 3),
        _row(
            "lidar in IMU, mm (x, y, z)",
            calibration["T_imu_lidar_translation"],
            std.get("extrinsic_translation"),
            1e3,
            1,
        ),
        _row(
            "lidar in IMU, rotation vector, °",
            rotation.tolist(),
            std.get("extrinsic_rotation"),
            degrees,
            3,
        ),
        _row("gyro bias, °/s", calibration["gyro_bias"], std.get("gyro_bias"), degrees, 4),
        _row("accelerometer bias, m/s²", calibration["accel_bias"], std.get("accel_bias"), 1.0, 4),
        _row("gravity in the map, m/s²", calibration["gravity"], None, 1.0, 4),
    ]
    if std.get("gravity"):
        rows.append(_row("direction of gravity, °", [0.0, 0.0], std["gravity"], degrees, 3))
    if "encoder_zero" in std:
        zero = [calibration.get("encoder_zero", 0.0)]
        rows.append(_row("encoder zero, °", zero, std["encoder_zero"], degrees, 3))
    head = ("quantity", "estimate", "standard deviation")
    return table(head, rows, numbers=frozenset({1, 2}))


def _row(
    name: str, values: Sequence[float], std: Sequence[float] | None, unit: float, digits: int
) -> tuple[str, str, str]:
    deviations = DASH if std is None else "   ".join(f"± {unit * s:.{digits}f}" for s in std)
    return name, "   ".join(f"{unit * v:.{digits}f}" for v in values), deviations
