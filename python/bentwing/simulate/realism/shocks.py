# SPDX-License-Identifier: MIT OR Apache-2.0
"""What shakes an accelerometer beyond what it can follow: blows, clipping, rectified vibration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.calibration import STANDARD_GRAVITY
from bentwing.simulate.realism.effect import about

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Shocks:
    """Blows to the unit's housing, which ring once and move the carrier nowhere.

    Attributes
    ----------
    times : (K,) s, of the blows
    lasting : (K,) s
    peaks : (K, 3) m/s²
    gyro_limit, accel_limit : rad/s, m/s², where they saturate
    rectified : (3,) m/s², what vibration at full strength adds to the accelerometer's bias
    """

    times: Array
    lasting: Array
    peaks: Array
    gyro_limit: float
    accel_limit: float
    rectified: Array

    def felt(self, times: Array, measured: Array, activity: Array) -> Array:
        """Return what the unit reports (M, 6) of what it would have without them."""
        accel = measured[:, 3:] + activity[:, None] * self.rectified
        for start, lasting, peak in zip(self.times, self.lasting, self.peaks, strict=True):
            since = (times - start) / lasting
            ring = np.where((since > 0) & (since < 1), np.sin(2 * np.pi * since), 0.0)
            accel = accel + ring[:, None] * peak
        gyro = np.clip(measured[:, :3], -self.gyro_limit, self.gyro_limit)
        return np.hstack([gyro, np.clip(accel, -self.accel_limit, self.accel_limit)])


def draw_shocks(rng: np.random.Generator, level: float, duration: float) -> Shocks:
    """Draw blows of 5 to 20 g for 5 to 30 ms, about one a minute at level 1."""
    n = max(1, round(level * duration / 60.0))
    directions = rng.normal(size=(n, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    sizes = rng.uniform(5.0, 20.0, n) * STANDARD_GRAVITY
    return Shocks(
        np.sort(rng.uniform(0.2, 0.9, n)) * duration,
        rng.uniform(0.005, 0.03, n),
        sizes[:, None] * directions,
        gyro_limit=float(np.radians(1000.0)),
        accel_limit=8.0 * STANDARD_GRAVITY,
        rectified=about(rng, 0.002 * level * STANDARD_GRAVITY, 3),
    )
