# SPDX-License-Identifier: MIT OR Apache-2.0
"""The spin of a recorded flight, driven by its own downdraft, wind and controller."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.flight.control.spin_controller import SpinSettings, spin_terms
from bentwing.simulate.heads.rates import SPIN_STEP, ornstein_uhlenbeck
from bentwing.simulate.plant.airflow import ROTORS, Air
from bentwing.simulate.plant.flights import CONTROL_STEP, GYRO_NOISE, SUBSTEPS
from bentwing.simulate.plant.head import SpunHead
from bentwing.simulate.plant.parameters import PlantSettings
from bentwing.simulate.splines import Spline, knot_times

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.trajectories import Flight

    Array = NDArray[np.float64]

_BREEZE, _GUSTY = 0.3, 1.5  # m/s, standard deviations of the wind without and with gusts
_MEMORY = 3.0  # s, of the wind
_FREE = 0.9  # of `turning`, above which nothing holds the head
_HELD_TIME = 0.2  # s, in which what holds a head stops it
_LEAST_ACTIVITY = 0.02  # of the rotors, below which the head stands still


def flight_air(flight: Flight, duration: float, rng: np.random.Generator, *, gusts: bool) -> Air:
    """Return the air that one flight meets at the controller's steps, as K carriers side by side."""
    n = int(np.ceil(knot_times(SPIN_STEP, duration)[-1] / CONTROL_STEP)) + 1
    times = CONTROL_STEP * np.arange(float(n))
    motion = flight.motion(times)
    sigma = _GUSTY if gusts else _BREEZE
    wind = [ornstein_uhlenbeck(rng, n, CONTROL_STEP, _MEMORY, sigma) for _ in range(2)]
    relative = np.column_stack([*wind, np.zeros(n)]) - motion.v
    thrust = flight.activity(times) ** 2
    body = np.einsum("nji,nj->ni", motion.R, relative) * (thrust > 0)[:, None]
    shake_time = PlantSettings().flow.turbulence_time
    shake = [ornstein_uhlenbeck(rng, n, CONTROL_STEP, shake_time, 1.0) for _ in ROTORS]
    return Air(body[:, :2], motion.v[:, 2], thrust, np.column_stack(shake))


def driven_spin(air: Air, desired: float, rng: np.random.Generator, turning: Array) -> Spline:
    """Return the angle of a head that the controller holds at `desired`, rad/s.

    Parameters
    ----------
    turning : (K,) 0 … 1 at the knots of `SPIN_STEP`, 0 where something holds the head
    """
    settings, head = SpinSettings(), SpunHead(PlantSettings(), rng.uniform(0.0, 2 * np.pi, 1))
    times = CONTROL_STEP * np.arange(len(air.climb))
    free = np.interp(times, SPIN_STEP * np.arange(len(turning)), turning)
    angles = np.empty(len(times))
    for k in range(len(times)):
        measured = head.rate + rng.normal(0.0, GYRO_NOISE, 1)
        command = spin_terms(settings, measured, desired).angle
        now = Air(*(part[k : k + 1] for part in (air.wind, air.climb, air.thrust, air.shake)))
        if free[k] < _FREE or air.thrust[k] < _LEAST_ACTIVITY:
            head.rate *= np.exp(-CONTROL_STEP / _HELD_TIME)
            head.angle += CONTROL_STEP * head.rate
        else:
            for _ in range(SUBSTEPS):
                head.step(now, command, CONTROL_STEP / SUBSTEPS)
        angles[k] = head.angle[0]
    return Spline(SPIN_STEP, np.interp(SPIN_STEP * np.arange(len(turning)), times, angles)[:, None])
