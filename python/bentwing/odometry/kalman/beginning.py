# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where a pass of the filter begins."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.odometry.kalman.core import first_covariance, first_state
from bentwing.recording.described import described_calibration

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.calibration import Calibration
    from bentwing.base.mount import Mount
    from bentwing.odometry.kalman.core import FilterState
    from bentwing.odometry.start import Start
    from bentwing.recording import ImuBatch, Payload

# The mean over a sweep differs from that of the rest by less, rad/s and m/s².
MAX_REST_RATE, MAX_REST_FORCE = 0.01, 0.15


@dataclass(frozen=True, slots=True)
class Rest:
    """Mean rate (3,), rad/s, and specific force (3,), m/s², of an IMU at rest."""

    rate: NDArray[np.float64]
    force: NDArray[np.float64]

    def lasts(self, imu: ImuBatch) -> bool:
        """Tell whether samples around a sweep are those of the same rest."""
        if not len(imu.times):
            return False
        turned = np.linalg.norm(imu.gyro.mean(axis=0) - self.rate)
        pushed = np.linalg.norm(imu.accel.mean(axis=0) - self.force)
        return bool(turned < MAX_REST_RATE and pushed < MAX_REST_FORCE)


@dataclass(frozen=True, slots=True)
class Beginning:
    """What a pass begins with.

    Attributes
    ----------
    time : s, IMU clock
    described : slow states as the payload says, with the mount as the filter takes it; sweeps are cut
        by stamps that are late by its latency
    rest : what the IMU says at rest, if that is how it begins
    state, covariance : at the time
    """

    time: float
    described: Calibration
    rest: Rest | None
    state: FilterState
    covariance: NDArray[np.float64]


def described_beginning(time: float, start: Start, payload: Payload, mount: Mount) -> Beginning:
    """Return the beginning as the payload describes the head, but for its mount."""
    static, described = start.static, replace(described_calibration(payload), mount=mount)
    return Beginning(
        time,
        described,
        None if static is None else Rest(static.gyro_bias, static.accel_mean),
        first_state(start, described),
        first_covariance(start, mount),
    )
