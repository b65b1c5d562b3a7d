# SPDX-License-Identifier: MIT OR Apache-2.0
"""A carrier in motion with a sensor head: where every frame truly is at any time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from bentwing.simulate.heads.joints import Joint, follow
from bentwing.simulate.kinematics import Motion

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.simulate.lidars.interface import Lidar
    from bentwing.simulate.scenes.mesh import Mesh
    from bentwing.simulate.splines import Spline

    Array = NDArray[np.float64]


class Carrier(Protocol):
    """What carries the head."""

    def motion(self, times: Array) -> Motion:
        """Motion of the body frame in the map."""
        ...

    def activity(self, times: Array) -> Array:
        """How strongly it vibrates, 0 … 1."""
        ...


@dataclass(frozen=True, slots=True)
class Encoder:
    """The motor's encoder: it reads the true angle less `zero`, with noise.

    Attributes
    ----------
    angle : true angle of the motor
    zero : rad, true angle where the encoder reads 0
    sigma : rad, noise
    """

    angle: Spline
    zero: float
    sigma: float

    def read(self, times: Array) -> Array:
        """Return the angle (N,), rad, that it reads without noise."""
        result: Array = self.angle(times)[:, 0] - self.zero
        return result


@dataclass(frozen=True, slots=True)
class Head:
    """A sensor head as it truly is, and as its user believes it to be.

    Attributes
    ----------
    to_imu, to_lidar : true joints from body to imu and from imu to lidar
    airframe : what of the carrier the lidar can see, body frame
    lidar : the scanner
    payload : `payload.yaml`: nominal values
    truth : true values of what `payload` has nominally
    encoder : of a motor-turned lidar
    """

    to_imu: Sequence[Joint]
    to_lidar: Sequence[Joint]
    airframe: Mesh
    lidar: Lidar
    payload: dict[str, Any]
    truth: dict[str, Any]
    encoder: Encoder | None = None


@dataclass(frozen=True, slots=True)
class Rig:
    """Motions of the frames of a head on its carrier."""

    carrier: Carrier
    head: Head

    def imu(self, times: Array) -> Motion:
        """Motion of the IMU in the map."""
        return follow(self.carrier.motion(times), self.head.to_imu, times)

    def lidar(self, times: Array) -> Motion:
        """Motion of the lidar in the map."""
        return follow(self.imu(times), self.head.to_lidar, times)

    def lidar_in_body(self, times: Array) -> Motion:
        """Motion of the lidar relative to the carrier."""
        return follow(_still(len(times)), [*self.head.to_imu, *self.head.to_lidar], times)


def _still(n: int) -> Motion:
    none = np.zeros((n, 3))
    return Motion(np.tile(np.eye(3), (n, 1, 1)), none, none, none, none, none)
