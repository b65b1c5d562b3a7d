# SPDX-License-Identifier: MIT OR Apache-2.0
"""Units that show in the samples alone: of the accelerations, the rates and the ranges."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.calibrate.set_up import edits
from bentwing.calibrate.set_up.errors import DefectError
from bentwing.recording import imu_units
from bentwing.recording.sections.imu import ImuUnits

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording import ImuBatch, Payload

# No lidar on a carrier sees half of its returns beyond this, m; in millimetres they begin there.
FARTHEST_MEDIAN = 250.0
MILLIMETRE = 1e-3


def with_range_unit(payload: Payload, points: NDArray[np.float64]) -> Payload:
    """Return the payload with the unit of the ranges of points (N, 3)."""
    median = float(np.median(np.linalg.norm(points, axis=1)))
    if median <= FARTHEST_MEDIAN:
        return payload
    return edits.with_lidar(payload, range_scale=MILLIMETRE)


def with_imu_units(payload: Payload, imu: ImuBatch, topic: str) -> Payload:
    """Return the payload with the units of the IMU's samples.

    Raises
    ------
    DefectError
        The samples are no reading of an IMU that moves under gravity.
    """
    if len(imu.times) < imu_units.MIN_SAMPLES:
        return payload
    for name, samples in (("gyro", imu.gyro), ("accelerometer", imu.accel)):
        if (np.ptp(samples, axis=0) == 0.0).all():
            msg = f"{topic}: the {name} shows the same in all samples; check it and its driver"
            raise DefectError(msg)
    accel = imu_units.accel_unit(imu.accel)
    if accel is None or imu_units.lacks_gravity(imu.times, imu.accel):
        msg = f"{topic}: {'; '.join(imu_units.problems(imu.times, imu.gyro, imu.accel))}"
        raise DefectError(msg)
    is_degrees = imu_units.gyro_scale(imu.times, imu.gyro, imu.accel) != 1.0
    units = ImuUnits(accel=accel, gyro="deg/s" if is_degrees else "rad/s")
    return payload if units == ImuUnits() else edits.with_imu(payload, units=units)
