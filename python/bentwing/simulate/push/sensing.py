# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the spun head sees, and what the carrier believes of itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.flight.control import CarrierState
from bentwing.simulate.lidars.hokuyo import ANGLE_INCREMENT, ANGLE_MIN, N_BEAMS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.push.quadrotor import Quadrotor
    from bentwing.simulate.scenes import World

    Array = NDArray[np.float64]

RANGE_NOISE, DROPOUT = 0.02, 0.02  # m, share of the beams
POSITION_NOISE, VELOCITY_NOISE = 0.02, 0.05  # m, m/s; `Odometry` is better than that
OWN = 0.45  # m, nearer returns are from the airframe and are filtered out
_MAX_RANGE = 30.0
_BEAMS = ANGLE_MIN + ANGLE_INCREMENT * np.arange(N_BEAMS)


def scan(world: World, carrier: Quadrotor, spins: Array, rng: np.random.Generator) -> Array:
    """Return the points (N, 3), m, map frame, of sweeps of the head turned by `spins` (S,), rad.

    The scan plane contains the vertical and its centre beam looks down (Kaul 2015, Fig. 4b); the
    IMU takes the carrier's tilt out of the plane's pose, so that it is left out here.
    """
    azimuths = spins[:, None] + carrier.yaw
    up = np.broadcast_to(-np.cos(_BEAMS), (len(spins), N_BEAMS))
    across = np.sin(_BEAMS)
    fans = np.stack([across * np.cos(azimuths), across * np.sin(azimuths), up], axis=-1)
    directions = np.ascontiguousarray(fans.reshape(-1, 3))
    origins = np.ascontiguousarray(np.broadcast_to(carrier.position, directions.shape))
    ranges, _ = world.scene.cast(origins, directions, _MAX_RANGE)
    lost = rng.random(len(ranges)) < DROPOUT
    seen = np.isfinite(ranges) & (ranges > OWN) & ~lost
    noisy = ranges[seen] + rng.normal(0.0, RANGE_NOISE, int(seen.sum()))
    return np.asarray(carrier.position + noisy[:, None] * directions[seen])


def believed(time: float, carrier: Quadrotor, rng: np.random.Generator) -> CarrierState:
    """Return the state as an estimator gives it."""
    return CarrierState(
        time,
        carrier.position + rng.normal(0.0, POSITION_NOISE, 3),
        carrier.velocity + rng.normal(0.0, VELOCITY_NOISE, 3),
        carrier.yaw,
    )
