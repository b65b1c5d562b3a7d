# SPDX-License-Identifier: MIT OR Apache-2.0
"""The noise of an IMU from its samples."""

from __future__ import annotations

from dataclasses import dataclass
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


@dataclass(frozen=True, slots=True)
class ImuNoise:
    """Noise densities of an IMU, vibration included.

    Attributes
    ----------
    gyro, accel : rad/s/√Hz, m/s²/√Hz
    """

    gyro: float
    accel: float

    @classmethod
    def of(cls, imu: ImuBatch) -> ImuNoise:
        """Measure it in samples in SI units, a second of them or more."""
        step = float(np.median(np.diff(imu.times)))
        return cls(_density(imu.gyro, step), _density(imu.accel, step))

    def at_least_in(self, payload: Payload) -> Payload:
        """Return the payload with no less noise than this."""
        imu = payload.imu or Imu()
        gyro, accel = max(imu.gyro_noise, self.gyro), max(imu.accel_noise, self.accel)
        return edits.with_imu(payload, gyro_noise=gyro, accel_noise=accel)


def states_noise(payload: Payload) -> bool:
    """Whether a payload says how noisy its IMU is."""
    return payload.imu is not None and bool(payload.imu.model_fields_set & _STATED)


def _density(samples: NDArray[np.float64], step: float) -> float:
    """Return the density of white noise in samples (M, 3) that are `step` seconds apart.

    Estimators see averages over a step of the trajectory, in which vibration at the samples' own rate
    cancels. Motion is smooth over three of them and cancels in their second differences.
    """
    n = max(1, round(DT / step))
    means = samples[: len(samples) // n * n].reshape(-1, n, 3).mean(axis=1)
    sigma = np.median(np.abs(np.diff(means, n=2, axis=0)), axis=0) / (_MEDIAN * _SECOND)
    return float(sigma.max() * np.sqrt(n * step))
