# SPDX-License-Identifier: MIT OR Apache-2.0
"""The registration's settings together with what the payload says, as the core takes them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.odometry.continuous.settings import RegistrationSettings
from bentwing.odometry.imu_noise import ImuNoise

if TYPE_CHECKING:
    from bentwing.recording import Payload


class CoreSettings(RegistrationSettings):
    """Sigmas in m and, per trajectory sample, in rad/s and m/s²."""

    range_sigma: float
    gyro_sigma: float
    accel_sigma: float

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

    def with_noise(self, noise: ImuNoise, dt: float) -> CoreSettings:
        """Return the settings with other densities."""
        if noise == self.noise(dt):
            return self
        sigmas = {"gyro_sigma": noise.gyro * dt**-0.5, "accel_sigma": noise.accel * dt**-0.5}
        return self.model_copy(update=sigmas)

    def noise(self, dt: float) -> ImuNoise:
        """Return the densities."""
        return ImuNoise(self.gyro_sigma * dt**0.5, self.accel_sigma * dt**0.5)
