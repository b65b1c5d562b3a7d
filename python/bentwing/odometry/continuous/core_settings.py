# SPDX-License-Identifier: MIT OR Apache-2.0
"""The registration's settings together with what the payload says, as the core takes them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.odometry.continuous.settings import RegistrationSettings
    from bentwing.recording import Payload


@dataclass(frozen=True, slots=True)
class CoreSettings:
    """Fields as in `RegistrationSettings`; sigmas in m, rad/s, m/s² per trajectory sample."""

    knot_interval: float
    range_sigma: float
    n_neighbors: int
    max_match_distance: float
    min_match_gap: float
    first_cauchy_scale: float
    cauchy_scale: float
    max_outer: int
    n_inner: int
    min_translation: float
    min_rotation: float
    velocity_sigma: float
    rate_sigma: float
    gyro_sigma: float
    accel_sigma: float
    motion_accel_density: float
    motion_angular_density: float

    @classmethod
    def of(cls, settings: RegistrationSettings, payload: Payload, dt: float) -> CoreSettings:
        """Combine settings and payload; a density over one sample has sigma density / √dt."""
        gyro = accel = 1.0
        if payload.imu is not None:
            gyro, accel = payload.imu.gyro_noise, payload.imu.accel_noise
        return cls(
            **settings.model_dump(),
            range_sigma=payload.lidar.range_sigma,
            gyro_sigma=gyro * dt**-0.5,
            accel_sigma=accel * dt**-0.5,
        )
