# SPDX-License-Identifier: MIT OR Apache-2.0
"""Flights of spun heads in closed loop: what the gyro says, what the controller does, the rates."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing.flight.control.spin_controller import SpinSettings, spin_terms
from bentwing.simulate.plant.head import SpunHead
from bentwing.simulate.plant.parameters import PlantSettings
from bentwing.simulate.plant.weather import Conditions, Weather

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

CONTROL_STEP = 0.02
"""s, the controller runs at 50 Hz, as its radio link and servos do."""
SUBSTEPS = 2
DELAY_STEPS = 2
"""Steps from a measurement to a servo that moves: computer, serial line, microcontroller."""
DESIRED = np.radians(360.0)
"""rad/s; close to 1 Hz maps best (Kaul 2015, section 5)."""
GYRO_NOISE = 0.02
"""rad/s, standard deviation with the vibration of the rotors."""


@dataclass(frozen=True, slots=True)
class Drive:
    """How a head is driven.

    Attributes
    ----------
    controller : None holds the vanes at `fixed_angle`
    fixed_angle : rad
    plant : what is driven
    """

    controller: SpinSettings | None = field(default_factory=SpinSettings)
    fixed_angle: float = 0.0
    plant: PlantSettings = field(default_factory=PlantSettings)


@dataclass(frozen=True, slots=True)
class Flown:
    """What N flights did, K samples each.

    Attributes
    ----------
    times : (K,) s since the rotors started
    rates, measured, desired, vanes : (K, N) float32, rad/s, rad/s, rad/s, rad
    """

    times: Array
    rates: NDArray[np.float32]
    measured: NDArray[np.float32]
    desired: NDArray[np.float32]
    vanes: NDArray[np.float32]


def fly(
    drive: Drive,
    weather: Weather,
    *,
    n: int,
    duration: float,
    seed: int,
    desired: Callable[[float], Array] | float = DESIRED,
    start: Array | None = None,
) -> Flown:
    """Fly `n` flights of `duration` s, as one array.

    Parameters
    ----------
    seed : the same seed has the same wind and pilot, however the head is driven
    desired : rad/s, constant or as (N,) at a time
    start : (N,) rad, where the first arms stand before take-off; default: anywhere
    """
    rng = np.random.default_rng(seed)
    angles = rng.uniform(0.0, 2 * np.pi, n)
    conditions = Conditions(weather, n, CONTROL_STEP, rng, drive.plant.flow.turbulence_time)
    gyro = np.random.default_rng([seed, 1])
    head = SpunHead(drive.plant, angles if start is None else start)
    n_steps = round(duration / CONTROL_STEP)
    record = np.zeros((4, n_steps, n), np.float32)
    commands = [np.zeros(n)] * DELAY_STEPS
    for k in range(n_steps):
        air, yaw = conditions.next()
        wish = np.broadcast_to(desired(k * CONTROL_STEP) if callable(desired) else desired, (n,))
        measured = head.rate + yaw + gyro.normal(0.0, GYRO_NOISE, n)
        commands = [*commands[1:], _command(drive, measured, wish)]
        for _ in range(SUBSTEPS):
            head.step(air, commands[0], CONTROL_STEP / SUBSTEPS)
        record[:, k] = head.rate, measured, wish, head.vanes
    times = CONTROL_STEP * np.arange(1.0, n_steps + 1.0)
    return Flown(times, *record)


def _command(drive: Drive, measured: Array, wish: Array) -> Array:
    if drive.controller is None:
        return np.full(len(measured), drive.fixed_angle)
    return spin_terms(drive.controller, measured, wish).angle
