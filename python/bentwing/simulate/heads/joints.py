# SPDX-License-Identifier: MIT OR Apache-2.0
"""Sensor heads: how IMU and lidar hang on the carrier, nominally and in truth.

Frames: `body` (the carrier: x forward, y left, z up), `imu`, `lidar`. A head is a chain of joints
from body to imu and one from imu to lidar.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.simulate.kinematics import Motion, rotation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.simulate.splines import Spline

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Mount:
    """A constant transform `T_b_c`.

    Attributes
    ----------
    R : (3, 3), `R_b_c`
    t : (3,) m, `t_b_c`
    """

    R: Array
    t: Array

    def follow(self, motion: Motion, _times: Array) -> Motion:
        """Motion of c, given that of b."""
        return motion.mounted(self.R, self.t)

    def perturbed(self, rng: np.random.Generator, angle: float, shift: float) -> Mount:
        """Return the mount turned by about `angle` (rad) and shifted by about `shift` (m) in random directions."""
        phi, t = (_direction(rng) * rng.uniform(0.7, 1.3) * size for size in (angle, shift))
        return Mount(self.R @ rotation(phi[None])[0], self.t + t)

    def as_dict(self) -> dict[str, list[float]]:
        """As `payload.yaml` has it."""
        return {
            "translation": [round(float(x), 9) for x in self.t],
            "quaternion": [round(float(x), 12) for x in geometry.from_matrices(self.R)],
        }


@dataclass(frozen=True, slots=True)
class Turn:
    """A joint that turns about a fixed axis."""

    axis: Array
    angle: Spline

    def follow(self, motion: Motion, times: Array) -> Motion:
        """Motion behind the joint, given that before it."""
        return motion.turned(self.axis, self.angle, times)


Joint = Mount | Turn


def follow(motion: Motion, joints: Sequence[Joint], times: Array) -> Motion:
    """Motion of the last frame of a chain of joints."""
    for joint in joints:
        motion = joint.follow(motion, times)
    return motion


def _direction(rng: np.random.Generator) -> Array:
    vector = rng.normal(size=3)
    unit: Array = vector / np.linalg.norm(vector)
    return unit
