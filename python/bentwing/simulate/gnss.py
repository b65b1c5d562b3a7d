# SPDX-License-Identifier: MIT OR Apache-2.0
"""A GNSS receiver on the carrier, and where on the Earth the simulated world is."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.geodesy import LevelFrame
from bentwing.simulate.records import FixRecord

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from numpy.typing import NDArray

    from bentwing.simulate.kinematics import Motion
    from bentwing.simulate.names import ReceiverName

    Array = NDArray[np.float64]

RATE_HZ = 5.0
OUTLIERS = 0.03
"""Share of the fixes that are reflected signals: metres to tens of metres off, reported as good."""
WANDER_TIME = 30.0
"""s, correlation time of the slow part of the errors."""
LEVER_ARM = (0.08, -0.05, 0.12)
# East and up, m: white, and slowly wandering.
_WHITE = {"rtk": (0.008, 0.015), "single": (0.3, 0.6)}
_WANDER = {"rtk": (0.008, 0.015), "single": (0.6, 1.2)}


@dataclass(frozen=True, slots=True)
class Place:
    """Where on the Earth a world is; all flights in it are there.

    Attributes
    ----------
    frame : level frame at the world's origin
    heading : rad, by which the world's x axis lies north of east
    """

    frame: LevelFrame
    heading: float

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Place:
        """Choose a place at the side of UTM zone 32, where grid north is one or two degrees off."""
        place = rng.uniform([10.5, 46.0, 200.0], [11.8, 49.0, 900.0])
        frame = LevelFrame(*(float(value) for value in place))
        return cls(frame, float(rng.uniform(-np.pi, np.pi)))

    def to_level(self, points: Array) -> Array:
        """Take points (N, 3) of the simulated world to east, north and up."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        turned: Array = points @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T
        return turned

    def truth(self) -> dict[str, Any]:
        """Return where the world is."""
        return {
            "longitude": self.frame.longitude,
            "latitude": self.frame.latitude,
            "height": self.frame.height,
            "heading": self.heading,
        }


@dataclass(slots=True)
class Receiver:
    """A receiver; its errors wander with the stream.

    Attributes
    ----------
    kind : `rtk` to a centimetre, `single` to a metre
    place : of the world
    rng : of the errors
    imu : motion of the IMU in the simulated world
    noiseless : without any error
    """

    kind: ReceiverName
    place: Place
    rng: np.random.Generator
    imu: Callable[[Array], Motion]
    noiseless: bool = False
    _wander: Array = field(init=False)

    def __post_init__(self) -> None:
        self._wander = self.rng.normal(size=3)

    def fixes(self, times: Array) -> list[FixRecord]:
        """Measure at times (N,) s."""
        motion = self.imu(times)
        world = motion.p + motion.R @ np.array(LEVER_ARM)
        points = self.place.to_level(world) + self._errors(len(times))
        places = self.place.frame.to_geodetic(points)
        white, wander = (np.array([t[self.kind][i] for i in (0, 0, 1)]) for t in (_WHITE, _WANDER))
        covariance = np.diag(white**2 + wander**2).ravel()
        return [
            FixRecord(time, time + 0.08, longitude, latitude, height, covariance)
            for time, (longitude, latitude, height) in zip(
                times.tolist(), places.tolist(), strict=True
            )
        ]

    def _errors(self, n: int) -> Array:
        errors = np.zeros((n, 3))
        if self.noiseless:
            return errors
        keep = np.exp(-1 / (RATE_HZ * WANDER_TIME))
        white, wander = (np.array([t[self.kind][i] for i in (0, 0, 1)]) for t in (_WHITE, _WANDER))
        for i in range(n):
            self._wander = keep * self._wander + np.sqrt(1 - keep**2) * self.rng.normal(size=3)
            errors[i] = wander * self._wander + white * self.rng.normal(size=3)
        reflected = self.rng.random(n) < OUTLIERS
        ways = self.rng.normal(size=(n, 3))
        ways /= np.linalg.norm(ways, axis=1)[:, None]
        return errors + reflected[:, None] * ways * self.rng.uniform(3.0, 30.0, (n, 1))
