# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the spun head sees, and what the carrier believes of itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.control import CarrierState
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


def scan(world: World, carrier: Quadrotor, spin: float, rng: np.random.Generator) -> Array:
    """Return the points (N, 3), m, map frame, of one sweep of the head turned by `spin` (rad).

    The scan plane contains the vertical and its centre beam looks down (Kaul 2015, Fig. 4b); the
    IMU takes the carrier's tilt out of the plane's pose, so that it is left out here.
    """
    across, up = np.sin(_BEAMS), -np.cos(_BEAMS)
    azimuth = spin + carrier.yaw
    directions = np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), up])
    origins = np.broadcast_to(carrier.position, directions.shape)
    ranges, _ = world.scene.cast(np.ascontiguousarray(origins), directions, _MAX_RANGE)
    seen = np.isfinite(ranges) & (ranges > OWN) & (rng.random(N_BEAMS) > DROPOUT)
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
