# SPDX-License-Identifier: MIT OR Apache-2.0
"""A quadrotor with attitude and height control, as a stick and the wind move it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GRAVITY = 9.80665


@dataclass(frozen=True, slots=True)
class QuadrotorSettings:
    """How it answers.

    Attributes
    ----------
    attitude_lag : s, twice in a row: attitude controller and rotors of a 4 kg carrier
    drag : 1/s, deceleration per airspeed; a tilt of 15° then flies 10 m/s
    hull_radius : m, with propellers
    below, above : m, extent of legs and rotors from its origin
    """

    attitude_lag: float = 0.08
    drag: float = 0.25
    hull_radius: float = 0.57
    below: float = 0.35
    above: float = 0.1


@dataclass(slots=True)
class Quadrotor:
    """State in the map frame; the height is held."""

    settings: QuadrotorSettings
    position: Array
    velocity: Array
    yaw: float
    tilt: Array = field(default_factory=lambda: np.zeros(2))
    _rotors: Array = field(default_factory=lambda: np.zeros(2))

    def step(self, roll: float, pitch: float, wind: Array, dt: float) -> None:
        """Fly `dt` s with commanded roll (right) and pitch (forward), rad, in `wind` (2,) m/s."""
        share = dt / (self.settings.attitude_lag + dt)
        self._rotors = self._rotors + share * (np.array([roll, pitch]) - self._rotors)
        self.tilt = self.tilt + share * (self._rotors - self.tilt)
        forward, left = GRAVITY * np.tan(self.tilt[1]), -GRAVITY * np.tan(self.tilt[0])
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        thrust = np.array([cos * forward - sin * left, sin * forward + cos * left])
        accel = thrust + self.settings.drag * (wind - self.velocity[:2])
        self.velocity[:2] += dt * accel
        self.position[:2] += dt * self.velocity[:2]
