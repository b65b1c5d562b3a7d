# SPDX-License-Identifier: MIT OR Apache-2.0
"""What an IMU measures: white noise, walking biases and the rotors' vibration."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.kinematics import Motion, apply

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bentwing.simulate.realism.inertial import InertialResponse
    from bentwing.simulate.realism.shocks import Shocks

    Array = NDArray[np.float64]

GRAVITY = np.array([0.0, 0.0, 9.80665])
RATE_HZ = 200.0
NODE_RATE_HZ = 100.0
"""The rate at which estimators combine samples, for the density that includes the vibration."""
HARMONICS = ((1, 1.0), (2, 0.03), (3, 0.01))
"""Order and share of the rotor tone's harmonics behind the sensor's low-pass filter."""
BROADBAND = 0.2
"""Share of the vibration that changes from sample to sample."""
AXIS_GAINS = (0.5, 1.0)
"""Between these, each axis feels its own share of the vibration."""


@dataclass(frozen=True, slots=True)
class ImuErrors:
    """Errors of the IMU; zeros make it perfect.

    Attributes
    ----------
    gyro_noise, accel_noise : rad/s/√Hz and m/s²/√Hz, white noise densities
    gyro_bias_walk, accel_bias_walk : rad/s²/√Hz and m/s³/√Hz
    gyro_bias, accel_bias : rad/s and m/s², size of the initial bias per axis
    gyro_vibration, accel_vibration : rad/s and m/s², amplitude of the rotor tone in flight
    rotor_hz : Hz, frequency of the rotor tone
    """

    gyro_noise: float = 5e-4
    accel_noise: float = 8e-4
    gyro_bias_walk: float = 1e-5
    accel_bias_walk: float = 1e-4
    gyro_bias: float = 0.01
    accel_bias: float = 0.06
    gyro_vibration: float = 0.015
    accel_vibration: float = 1.5
    rotor_hz: float = 90.0

    def densities(self) -> tuple[float, float]:
        """Return gyro and accelerometer densities with what averaging leaves of the vibration.

        Averaging two samples into a node damps a tone of frequency f by cos²(π f T), aliased
        harmonics included; the broadband part of the vibration counts as white noise.
        """
        orders, shares = np.array(HARMONICS).T
        passed = shares * np.cos(np.pi * orders * self.rotor_hz / RATE_HZ) ** 2
        tonal = np.linalg.norm(passed) / np.sqrt(NODE_RATE_HZ)
        left = float(np.hypot(tonal, BROADBAND * np.linalg.norm(shares) / np.sqrt(RATE_HZ)))
        # Amplitude to standard deviation, with the mean square of the axes' gains.
        left *= np.sqrt(np.mean(np.linspace(*AXIS_GAINS, 100) ** 2) / 2)
        gyro = np.hypot(self.gyro_noise, left * self.gyro_vibration)
        accel = np.hypot(self.accel_noise, left * self.accel_vibration)
        return float(gyro), float(accel)


PERFECT = ImuErrors(*[0.0] * 8)


@dataclass(slots=True)
class Imu:
    """Samples in time order, `sample` after `sample`.

    Attributes
    ----------
    activity : how hard the rotors work (0 … 1) at given times
    response : how it answers to rates and forces, if not perfectly
    shocks : what shakes it beyond what it can follow
    biases : (6,) current gyro and accelerometer bias, as they are at the start's temperature
    """

    errors: ImuErrors
    rng: np.random.Generator
    activity: Callable[[Array], Array]
    response: InertialResponse | None = None
    shocks: Shocks | None = None
    biases: Array = field(init=False)
    _phase: float = field(init=False)
    _directions: tuple[Array, Array] = field(init=False)

    def __post_init__(self) -> None:
        sizes = np.repeat([self.errors.gyro_bias, self.errors.accel_bias], 3)
        self.biases = self.rng.uniform(-1.0, 1.0, 6) * sizes
        self._phase = self.rng.uniform(0.0, 2 * np.pi)
        self._directions = (
            self.rng.uniform(*AXIS_GAINS, 6),
            self.rng.uniform(0.0, 2 * np.pi, (3, 6)),
        )

    def sample(self, times: Array, motion: Motion) -> tuple[Array, Array]:
        """Gyro and accelerometer (M, 3) at `times`, given the IMU frame's true motion."""
        ideal = np.hstack([motion.omega, specific_force(motion)])
        if self.response is not None:
            ideal = self.response.felt(times, ideal)
        measured = ideal + self._walk(len(times)) + self._noise(len(times)) + self._vibrate(times)
        if self.shocks is not None:
            measured = self.shocks.felt(times, measured, self.activity(times))
        return measured[:, :3], measured[:, 3:]

    def biases_at(self, time: float) -> Array:
        """Return the current biases (6,), with what the temperature has changed until `time`, s."""
        if self.response is None:
            return self.biases.copy()
        return np.asarray(self.biases + self.response.drifted(np.array([time]))[0])

    def _walk(self, n: int) -> Array:
        e = self.errors
        steps = np.repeat([e.gyro_bias_walk, e.accel_bias_walk], 3) / np.sqrt(RATE_HZ)
        walk = self.biases + np.cumsum(self.rng.normal(size=(n, 6)) * steps, axis=0)
        self.biases = walk[-1]
        return np.asarray(walk)

    def _noise(self, n: int) -> Array:
        sigma = np.repeat([self.errors.gyro_noise, self.errors.accel_noise], 3) * np.sqrt(RATE_HZ)
        return np.asarray(self.rng.normal(size=(n, 6)) * sigma)

    def _vibrate(self, times: Array) -> Array:
        """Return the rotor tone, its frequency wandering, and two harmonics past the sensor's filter."""
        e = self.errors
        gains, offsets = self._directions
        frequency = e.rotor_hz * (1.0 + 0.01 * np.sin(0.7 * times) + 0.004 * np.sin(2.9 * times))
        phase = self._phase + 2 * np.pi * np.cumsum(frequency) / RATE_HZ
        self._phase = float(phase[-1] % (2 * np.pi))
        tones = sum(share * np.sin(k * phase[:, None] + offsets[k - 1]) for k, share in HARMONICS)
        size = np.repeat([e.gyro_vibration, e.accel_vibration], 3) * gains
        strength = self.activity(times) * (1.0 + BROADBAND * self.rng.normal(size=len(times)))
        return np.asarray(tones * size * strength[:, None])


def specific_force(motion: Motion) -> Array:
    """Return what an accelerometer at the frame's origin feels (M, 3): +g upwards at rest."""
    return apply(motion.R.transpose(0, 2, 1), motion.a + GRAVITY)
