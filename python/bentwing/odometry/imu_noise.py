# SPDX-License-Identifier: MIT OR Apache-2.0
"""The noise of an IMU from its samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.trajectory import DT

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording import ImuBatch

# The median of the absolute values of normal numbers, in standard deviations.
_MEDIAN = 0.6745
# Fourth differences of white noise, 1 -4 6 -4 1, are so much larger than it.
_FOURTH = np.sqrt(70.0)
# A noise that is stated is right by so much: so far measured ones of simulated recordings are apart.
_RIGHT = 1.5
GYRO_FLOOR, ACCEL_FLOOR = 5e-4, 0.01
"""rad/s/√Hz and m/s²/√Hz, that any carrier has: what it does beyond the noise is more than that."""
# Fewer samples do not tell, nor what they cover in less time, s; what a gap between them covers does not count.
_FEWEST, _ENOUGH = 16, 1.0


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


@dataclass(frozen=True, slots=True)
class BelievedNoise:
    """What a window is weighted with: what is stated, unless the samples contradict it.

    A carrier vibrates more in one window than in another, and a stated noise includes it. So a noise is too
    small against what a window shows, and too large against the most that any has shown.

    Attributes
    ----------
    stated : by the payload
    most : that any window has shown so far
    now : in the last window
    """

    stated: ImuNoise
    most: ImuNoise
    now: ImuNoise

    @classmethod
    def as_stated(cls, stated: ImuNoise) -> BelievedNoise:
        """Return what is believed before anything was measured."""
        return cls(stated, ImuNoise(0.0, 0.0), stated)

    def after(self, imu: ImuBatch, *, settled: bool) -> BelievedNoise:
        """Return what is believed of a window with these samples.

        Parameters
        ----------
        settled : whether a motion has lasted for so long that its vibration is known
        """
        n = len(imu.times)
        if n < _FEWEST or n * float(np.median(np.diff(imu.times))) < _ENOUGH:
            return self
        shown = ImuNoise.of(imu)
        most = ImuNoise(
            max(self.most.gyro, shown.gyro, GYRO_FLOOR),
            max(self.most.accel, shown.accel, ACCEL_FLOOR),
        )

        def believed(stated: float, shown: float, most: float) -> float:
            if shown > _RIGHT * stated:
                return shown
            is_too_large = settled and _RIGHT * most < stated
            return most if is_too_large else stated

        now = ImuNoise(
            believed(self.stated.gyro, shown.gyro, most.gyro),
            believed(self.stated.accel, shown.accel, most.accel),
        )
        return BelievedNoise(self.stated, most, now)


def _density(samples: NDArray[np.float64], step: float) -> float:
    """Return the density of white noise in samples (M, 3) that are `step` seconds apart.

    Estimators see averages over a step of the trajectory, in which vibration at the samples' own rate
    cancels. Motion is smooth over five of them and cancels in their fourth differences: in second ones a head
    that nods leaves three times the noise of a gyro.
    """
    n = max(1, round(DT / step))
    means = samples[: len(samples) // n * n].reshape(-1, n, 3).mean(axis=1)
    sigma = np.median(np.abs(np.diff(means, n=4, axis=0)), axis=0) / (_MEDIAN * _FOURTH)
    return float(sigma.max() * np.sqrt(n * step))
