# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the flights meet: wind, gusts, the pilot's manoeuvres, and the shake of the wakes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.plant.airflow import ROTORS, Air

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Weather:
    """Wind near the ground and a mapping flight in it.

    Attributes
    ----------
    max_wind : m/s, wind and gust together never exceed it
    max_mean : m/s, the flights' mean winds are uniform up to it
    turbulence : standard deviation of the slow turbulence in units of the mean wind: rough
        terrain (MIL-F-8785C at low altitude has 0.2)
    turbulence_length : m, its length scale a few metres above the ground (the same)
    gust_interval : s, mean time between single gusts, 1 − cos in shape
    gust_time : s, shortest and longest gust
    max_speed : m/s, of the carrier over the ground (Kaul 2015 flies 0.5 to 2 m/s)
    max_climb, max_descent : m/s
    vertical_interval : s, mean time between climbs or descents
    yaw_rate : rad/s, standard deviation of the carrier's
    """

    max_wind: float = 6.0
    max_mean: float = 3.0
    turbulence: float = 0.2
    turbulence_length: float = 30.0
    gust_interval: float = 20.0
    gust_time: tuple[float, float] = (1.5, 6.0)
    max_speed: float = 2.0
    max_climb: float = 1.5
    max_descent: float = 1.5
    vertical_interval: float = 25.0
    yaw_rate: float = 0.15


_LEG_TIME = 8.0  # s, mean time between changes of the course
_CARRIER_LAG = 1.0  # s, in which a quadrotor takes a new velocity
_YAW_TIME = 2.0  # s, memory of the yaw rate
_THRUST_TIME, _THRUST_SIGMA = 0.5, 0.06  # work of the altitude controller
_VERTICAL_TIME = 3.5  # s, length of a climb or descent
_SPOOL = 2.5  # s, from rest to hover thrust
# The wind grows with the height as over grass, log(h / z0), from the parked vanes to the flight.
_ROUGHNESS, _PARKED, _HEIGHT, _CLIMB_RATE = 0.05, 0.4, 5.0, 1.0  # m, m, m, m/s


class Conditions:
    """Air that N flights meet, step by step; the same seed gives the same, whatever flies.

    Parameters
    ----------
    weather : its kind
    n : flights
    dt : s, between steps
    """

    def __init__(
        self, weather: Weather, n: int, dt: float, rng: np.random.Generator, shake_time: float
    ) -> None:
        self._weather, self._n, self._dt, self._rng = weather, n, dt, rng
        self._shake_time = shake_time
        self._mean = rng.uniform(0.0, weather.max_mean, n)
        self._from = rng.uniform(0.0, 2 * np.pi, n)
        self._heading = rng.uniform(0.0, 2 * np.pi, n)
        self._eddies, self._yaw, self._thrust = np.zeros((n, 2)), np.zeros(n), np.zeros(n)
        self._shake = rng.normal(size=(n, len(ROTORS)))
        self._gust_start, self._gust_end = np.full(n, -2.0), np.full(n, -1.0)
        self._gust = np.zeros((n, 2))
        self._course, self._velocity = np.zeros((n, 2)), np.zeros((n, 2))
        self._vertical, self._vertical_end, self._climb = np.zeros(n), np.zeros(n), np.zeros(n)
        self._time = 0.0

    def next(self) -> tuple[Air, Array]:
        """Return the next step's air and the carriers' yaw rates (N,), rad/s."""
        self._time += self._dt
        self._blow()
        self._fly()
        thrust = (1.0 + self._thrust) * np.clip(self._time / _SPOOL, 0.0, 1.0) ** 2
        relative = self._limited_wind() - self._velocity
        cos, sin = np.cos(self._heading), np.sin(self._heading)
        wind = np.column_stack(
            [
                cos * relative[:, 0] + sin * relative[:, 1],
                cos * relative[:, 1] - sin * relative[:, 0],
            ]
        )
        self._shake = self._wandering(self._shake, self._shake_time, 1.0)
        return Air(wind, self._climb.copy(), thrust, self._shake), self._yaw.copy()

    def _blow(self) -> None:
        w, rng = self._weather, self._rng
        memory = w.turbulence_length / np.maximum(self._mean, 0.5)
        sigma = w.turbulence * self._mean
        self._eddies = self._wandering(self._eddies, memory[:, None], sigma[:, None])
        draws = rng.uniform(size=(4, self._n))
        begins = (self._time > self._gust_end) & (draws[0] < self._dt / w.gust_interval)
        shortest, longest = w.gust_time
        length = shortest + (longest - shortest) * draws[1]
        self._gust_start = np.where(begins, self._time, self._gust_start)
        self._gust_end = np.where(begins, self._time + length, self._gust_end)
        size = (w.max_wind - self._mean) * draws[2]
        heading = self._from + np.radians(40.0) * (2 * draws[3] - 1)
        gust = size[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
        self._gust = np.where(begins[:, None], gust, self._gust)

    def _limited_wind(self) -> Array:
        steady = self._mean[:, None] * np.column_stack([np.cos(self._from), np.sin(self._from)])
        share = (self._time - self._gust_start) / (self._gust_end - self._gust_start)
        swell = np.where((share > 0) & (share < 1), 0.5 - 0.5 * np.cos(2 * np.pi * share), 0.0)
        wind = steady + self._eddies + swell[:, None] * self._gust
        speed = np.linalg.norm(wind, axis=1, keepdims=True)
        limited = np.minimum(1.0, self._weather.max_wind / np.maximum(speed, 1e-9))
        return np.asarray(wind * limited * self._shelter())

    def _shelter(self) -> float:
        """Share of the wind that blows at the height reached since take-off."""
        height = np.clip(_PARKED + _CLIMB_RATE * (self._time - _SPOOL), _PARKED, _HEIGHT)
        return float(np.log(height / _ROUGHNESS) / np.log(_HEIGHT / _ROUGHNESS))

    def _fly(self) -> None:
        w, rng, dt = self._weather, self._rng, self._dt
        draws = rng.uniform(size=(6, self._n))
        turns = draws[0] < dt / _LEG_TIME
        heading = 2 * np.pi * draws[1]
        course = w.max_speed * draws[2, :, None]
        course = course * np.column_stack([np.cos(heading), np.sin(heading)])
        self._course = np.where(turns[:, None], course, self._course)
        self._velocity += dt / _CARRIER_LAG * (self._course - self._velocity)
        free = self._time > self._vertical_end
        begins = free & (draws[3] < dt / w.vertical_interval)
        wanted = np.where(draws[4] < 0.5, w.max_climb, -w.max_descent) * draws[5]
        self._vertical_end = np.where(begins, self._time + _VERTICAL_TIME, self._vertical_end)
        self._vertical = np.where(begins, wanted, np.where(free, 0.0, self._vertical))
        self._climb += dt / _CARRIER_LAG * (self._vertical - self._climb)
        self._yaw = self._wandering(self._yaw, _YAW_TIME, w.yaw_rate)
        self._heading += dt * self._yaw
        self._thrust = self._wandering(self._thrust, _THRUST_TIME, _THRUST_SIGMA)

    def _wandering(self, value: Array, memory: Array | float, sigma: Array | float) -> Array:
        """One step of an Ornstein–Uhlenbeck process."""
        decay = np.exp(-self._dt / memory)
        noise = self._rng.normal(size=value.shape)
        return np.asarray(decay * value + sigma * np.sqrt(1.0 - decay**2) * noise)
