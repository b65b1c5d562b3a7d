# SPDX-License-Identifier: MIT OR Apache-2.0
"""How a passively spun head turns."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.splines import Spline

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

SPIN_STEP = 0.25
SPIN_RANGE = np.radians([180.0, 460.0])


def ornstein_uhlenbeck(
    rng: np.random.Generator, n: int, step: float, relaxation: float, sigma: float
) -> Array:
    """Draw a random process (n,) with zero mean, standard deviation `sigma` and memory `relaxation`."""
    decay = np.exp(-step / relaxation)
    shocks = rng.normal(0.0, sigma * np.sqrt(1 - decay**2), n)
    values = np.empty(n)
    value = rng.normal(0.0, sigma)
    for i, shock in enumerate(shocks):
        value = decay * value + shock
        values[i] = value
    return values


def spin_angle(rng: np.random.Generator, mean: float, drive: Array) -> Spline:
    """Angle of a payload spun by the downdraft, about the carrier's vertical axis.

    Parameters
    ----------
    mean : rad/s, mean rate
    drive : (K,) 0 … 1 at the knots of `SPIN_STEP`, share of the full rate
    """
    wander = ornstein_uhlenbeck(rng, len(drive), SPIN_STEP, 4.0, np.radians(25.0))
    rate = np.clip(mean + wander, *SPIN_RANGE) * drive
    angle = rng.uniform(0.0, 2 * np.pi) + np.cumsum(rate) * SPIN_STEP
    return Spline(SPIN_STEP, angle[:, None])


def spin_drive(activity: Array) -> Array:
    """Share of the full spin rate: the payload's inertia lags behind the rotors."""
    drive = np.empty_like(activity)
    value = 0.0
    for i, active in enumerate(activity):
        value += (active - value) * SPIN_STEP / (1.3 if active > value else 2.5)
        drive[i] = value if value > 1e-3 else 0.0
    return drive
