# SPDX-License-Identifier: MIT OR Apache-2.0
"""The air at the vanes: four focused wakes with gaps between them, leaned over by the wind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.plant.parameters import Carrier, Flow

    Array = NDArray[np.float64]

ROTORS = np.radians([45.0, 135.0, 225.0, 315.0])
"""Azimuths of the rotors, x forward."""
_LEAST_DOWNDRAFT = 1.0
"""m/s; a slower wake leans over no farther."""


@dataclass(frozen=True, slots=True)
class Air:
    """What N carriers fly through, body frame.

    Attributes
    ----------
    wind : (N, 2) m/s, horizontal velocity of the air relative to the carrier
    climb : (N,) m/s, upward velocity of the carrier through the air
    thrust : (N,) in units of the weight
    shake : (N, 4) relative fluctuation of each wake, standard deviation 1
    """

    wind: Array
    climb: Array
    thrust: Array
    shake: Array


def induced(carrier: Carrier, air: Air) -> Array:
    """Induced velocity at the discs (N,), m/s, by momentum theory.

    The product of its two exact cases: vertical motion, where in descent the theory fails and the
    measured curve of Leishman 2006, eq. (2.96), stands in, and level flight, v √(V² + v²) = v_h².
    """
    hover = carrier.hover_induced * np.sqrt(np.maximum(air.thrust, 0.0))
    scale = np.maximum(hover, 1e-3)
    x = np.clip(air.climb / scale, -1.0, 2.0)
    up = np.sqrt(0.25 * x * x + 1.0) - 0.5 * x
    down = 1.0 + x * (-1.125 + x * (-1.372 + x * (-1.718 - 0.655 * x)))
    across = 0.5 * (air.wind**2).sum(axis=1) / scale**2
    # √(a² + 1) − a, written so that nothing cancels where the wind is large.
    level = np.sqrt(1.0 / (np.sqrt(across**2 + 1.0) + across))
    return np.asarray(hover * np.where(x >= 0, up, down) * level)


def downdraft(carrier: Carrier, flow: Flow, air: Air, places: Array) -> Array:
    """Downward speed of the air (N, K), m/s, at `places` (N, K, 2) in the plane of the vanes."""
    v = induced(carrier, air)
    # A wake that the carrier sinks into is not carried away and does not develop.
    sinking = np.clip(-air.climb / np.maximum(v, 1e-3), 0.0, 1.0)
    development = 1.0 + (carrier.development - 1.0) * (1.0 - sinking)
    speed = np.maximum(v * development + air.climb, 0.0)
    unsteady = flow.turbulence + flow.ring_state * sinking
    speeds = speed[:, None] * np.maximum(1.0 + unsteady[:, None] * air.shake, 0.0)
    lean = carrier.wake_depth / np.maximum(speed, _LEAST_DOWNDRAFT)
    shift = air.wind * lean[:, None]
    hubs = carrier.hub_distance * np.column_stack([np.cos(ROTORS), np.sin(ROTORS)])
    centres = hubs + shift[:, None, :]
    apart = places[:, :, None, :] - centres[:, None, :, :]
    profile = _profile(carrier, flow, np.sqrt((apart**2).sum(axis=-1)))
    return np.asarray((profile * speeds[:, None, :]).sum(axis=-1) + flow.gap * speed[:, None])


def _profile(carrier: Carrier, flow: Flow, distances: Array) -> Array:
    inside = 0.5 - 0.5 * np.tanh((distances - carrier.wake_radius) / flow.edge)
    hub = np.exp(-((distances / (flow.hub_radius * carrier.rotor_radius)) ** 2))
    return np.asarray(inside * (1.0 - flow.hub_loss * hub))
