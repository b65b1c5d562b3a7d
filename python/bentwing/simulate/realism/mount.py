# SPDX-License-Identifier: MIT OR Apache-2.0
"""An elastic mount, which rings while the carrier shakes it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import lfilter

from bentwing.simulate.heads.joints import Joint, Mount, Turn
from bentwing.simulate.splines import Spline, knot_times

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.rig import Carrier

    Array = NDArray[np.float64]

STEP = 0.004
"""s, between the controls: a tone of 25 Hz keeps nine tenths of its size."""
STRIDE = 0.5
"""m/s, from which on a carrier shakes what it carries as much as rotors do."""


@dataclass(frozen=True, slots=True)
class ElasticMount:
    """Rotations of the lidar about a point of the mount.

    Attributes
    ----------
    frequency : Hz, its own
    damping : ratio
    size : rad, root mean square of the rotation under full load
    pivot : (3,) m, IMU frame
    angles : about x, y and z of the IMU frame
    """

    frequency: float
    damping: float
    size: float
    pivot: Array
    angles: tuple[Spline, ...] = field(repr=False)

    def joints(self) -> list[Joint]:
        """Return joints from the IMU to the same place of a mount that shakes."""
        turns = [Turn(axis, angle) for axis, angle in zip(np.eye(3), self.angles, strict=True)]
        there, back = Mount(np.eye(3), self.pivot), Mount(np.eye(3), -self.pivot)
        return [there, *turns, back]


def draw_mount(
    rng: np.random.Generator, level: float, carrier: Carrier, duration: float
) -> ElasticMount:
    """Draw a mount that shakes by 0.02° times the level at 8 to 25 Hz."""
    frequency, damping = float(rng.uniform(8.0, 25.0)), float(rng.uniform(0.05, 0.2))
    size = float(np.radians(0.02)) * level
    knots = knot_times(STEP, duration)
    load = _load(carrier, knots)
    angles = []
    for _ in range(3):
        ringing = _ringing(rng, len(knots), frequency, damping)
        angles.append(Spline(STEP, (size / np.sqrt(3) * load * ringing)[:, None]))
    return ElasticMount(frequency, damping, size, rng.uniform(-0.1, 0.1, 3), tuple(angles))


def _ringing(rng: np.random.Generator, n: int, frequency: float, damping: float) -> Array:
    """Noise (n,) of unit size through a damped oscillator."""
    omega = 2 * np.pi * frequency * STEP
    radius = np.exp(-damping * omega)
    turn = omega * np.sqrt(1 - damping**2)
    poles = [1.0, -2 * radius * np.cos(turn), radius**2]
    values = lfilter([1.0], poles, rng.normal(size=n))
    result: Array = values / np.std(values)
    return result


def _load(carrier: Carrier, times: Array) -> Array:
    """How much the mount is shaken, 0 … 1: by rotors, by steps or by the road."""
    speed = np.linalg.norm(carrier.motion(times).v, axis=1)
    load: Array = np.maximum(carrier.activity(times), np.clip(speed / STRIDE, 0.0, 1.0))
    return load
