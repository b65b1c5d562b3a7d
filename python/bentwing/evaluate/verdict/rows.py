# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether windows find the IMU as noisy as it is stated to be, gyro and accelerometer apart."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.evaluate.verdict.evidence import Evidence
from bentwing.evaluate.verdict.stretches import over_time
from bentwing.odometry.imu_noise import ACCEL_FLOOR, GYRO_FLOOR

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.base.window_record import WindowRecord
    from bentwing.recording.sections.imu import Imu

_FEWEST = 4  # windows that can say something


def judge_rows(windows: Sequence[WindowRecord], imu: Imu | None) -> list[Evidence]:
    """Judge by the residuals of the IMU in windows, in units of what its noise leaves to expect."""
    if imu is None:
        return []
    stated = [imu.gyro_noise, imu.accel_noise]
    noise = [stated if w.imu_noise is None else w.imu_noise for w in windows]
    gyro = [
        (w.time, w.gyro_rms, n[0])
        for w, n in zip(windows, noise, strict=True)
        if w.gyro_rms is not None
    ]
    accel = [
        (w.time, w.accel_rms, n[1])
        for w, n in zip(windows, noise, strict=True)
        if w.accel_rms is not None
    ]
    return [
        *_judge("gyro_noise", gyro, GYRO_FLOOR),
        *_judge("accelerometer_noise", accel, ACCEL_FLOOR),
    ]


def _judge(kind: str, known: Sequence[tuple[float, float, float]], floor: float) -> list[Evidence]:
    if len(known) < _FEWEST:
        return []
    times, values, noise = np.array(known).T
    found = over_time(times, values * noise / np.hypot(noise, floor))
    return [Evidence(kind, found.high, found.spans_over(kind, np.asarray))]
