# SPDX-License-Identifier: MIT OR Apache-2.0
"""An inertial unit as it is made: scale, misalignment, g-sensitivity and biases that warm up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.calibration import STANDARD_GRAVITY
from bentwing.simulate.realism.effect import about

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

WARMING = 600.0
"""s, in which its temperature comes near its last by all but a third."""


@dataclass(frozen=True, slots=True)
class InertialResponse:
    """How a unit answers to rates and forces.

    Attributes
    ----------
    gyro, accel : (3, 3), what they report of each axis; the identity if perfect
    g_sensitivity : (3, 3) rad/s per m/s², by which forces feign rates
    heated : (6,) rad/s and m/s², change of the biases once it is warm
    """

    gyro: Array
    accel: Array
    g_sensitivity: Array
    heated: Array

    def felt(self, times: Array, ideal: Array) -> Array:
        """Return rates and forces (M, 6) as reported, before noise."""
        rates, forces = ideal[:, :3], ideal[:, 3:]
        gyro = rates @ self.gyro.T + forces @ self.g_sensitivity.T
        return np.hstack([gyro, forces @ self.accel.T]) + self.drifted(times)

    def drifted(self, times: Array) -> Array:
        """Return the biases' change by temperature (M, 6) since the start."""
        warm = -np.expm1(-np.asarray(times) / WARMING)
        result: Array = warm[:, None] * self.heated
        return result


def draw_response(rng: np.random.Generator, level: float) -> InertialResponse:
    """Draw a unit between a consumer's and an industrial one."""
    warming = rng.uniform(5.0, 20.0)
    per_degree = np.repeat([np.radians(0.010), 1.5e-4 * STANDARD_GRAVITY], 3)
    return InertialResponse(
        _matrix(rng, level),
        _matrix(rng, level),
        rng.normal(0.0, np.radians(0.05) / STANDARD_GRAVITY * level, (3, 3)),
        about(rng, 1.0, 6) * per_degree * warming * level,
    )


def _matrix(rng: np.random.Generator, level: float) -> Array:
    """Scales of about 0.3 %, axes that are about 0.15° off."""
    matrix = np.eye(3) + np.diag(about(rng, 0.003 * level, 3))
    for axis in range(3):
        # Each axis leans in a direction of its own.
        others = [i for i in range(3) if i != axis]
        heading = rng.uniform(0.0, 2 * np.pi)
        lean = np.radians(0.15) * level * rng.uniform(0.7, 1.3)
        matrix[axis, others] = lean * np.array([np.cos(heading), np.sin(heading)])
    return matrix
