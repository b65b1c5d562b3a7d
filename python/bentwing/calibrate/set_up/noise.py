# SPDX-License-Identifier: MIT OR Apache-2.0
"""The noise of an IMU that nobody describes, vibration included, from its samples."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.trajectory import DT
from bentwing.calibrate.set_up import edits
from bentwing.recording.sections.imu import Imu

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording import ImuBatch, Payload

_STATED = frozenset({"gyro_noise", "accel_noise"})
# The median of the absolute values of normal numbers, in standard deviations.
_MEDIAN = 0.6745
# Second differences of white noise, -1 2 -1, are so much larger than it.
_SECOND = np.sqrt(6.0)


def with_imu_noise(payload: Payload, imu: ImuBatch) -> Payload:
    """Return the payload with the noise densities of its IMU, where it states none.

    Parameters
    ----------
    imu : samples in SI units, in motion
    """
    described = payload.imu or Imu()
    if described.model_fields_set & _STATED or float(np.ptp(imu.times)) < 1.0:
        return payload
    step = float(np.median(np.diff(imu.times)))
    gyro, accel = (_density(samples, step) for samples in (imu.gyro, imu.accel))
    return edits.with_imu(
        payload,
        gyro_noise=max(described.gyro_noise, gyro),
        accel_noise=max(described.accel_noise, accel),
    )


def _density(samples: NDArray[np.float64], step: float) -> float:
    """Return the density of white noise in samples (M, 3) that are `step` seconds apart.

    Estimators see averages over a step of the trajectory, in which vibration at the samples' own rate
    cancels. Motion is smooth over three of them and cancels in their second differences.
    """
    n = max(1, round(DT / step))
    means = samples[: len(samples) // n * n].reshape(-1, n, 3).mean(axis=1)
    sigma = np.median(np.abs(np.diff(means, n=2, axis=0)), axis=0) / (_MEDIAN * _SECOND)
    return float(sigma.max() * np.sqrt(n * step))
