# SPDX-License-Identifier: MIT OR Apache-2.0
"""The frame in which a report shows a map: north up where it is on the Earth, else the map's own."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory

_ROUND = -2  # digits of the origin: hundreds of metres


@dataclass(frozen=True, slots=True)
class ShownFrame:
    """Coordinates that a map is written in, less a round origin: `R (p - middle) + place`.

    Attributes
    ----------
    R : (3, 3), from the map's axes
    middle, place : (3,) m, of the map, and where that is shown
    origin : (3,) m, to add to what is shown for the coordinates that are written
    is_north_up : whether y is grid north
    """

    R: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    middle: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    place: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    origin: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    is_north_up: bool = False

    @classmethod
    def of(cls, georeference: Mapping[str, Any] | None) -> ShownFrame:
        """Return the frame of a run, from what its record says of its place on the Earth."""
        linear = (georeference or {}).get("linear")
        if not linear:
            return cls()
        # A projection stretches by less than a thousandth: its turn is what a picture needs.
        u, _, vt = np.linalg.svd(np.array(linear["matrix"]))
        place = np.array(linear["projected"])
        origin = np.append(np.round(place[:2], _ROUND), 0.0)
        is_on_earth = "epsg" in (georeference or {})
        return cls(u @ vt, np.array(linear["map"]), place - origin, origin, is_on_earth)

    def points(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Shown coordinates (N, 3) m of points (N, 3) m of the map."""
        shown: NDArray[np.float64] = (points - self.middle) @ self.R.T + self.place
        return shown

    def trajectory(self, trajectory: Trajectory) -> Trajectory:
        """Turn poses in the map to the axes that are shown."""
        turn = np.broadcast_to(geometry.from_matrices(self.R[None]), trajectory.quats_xyzw.shape)
        return replace(
            trajectory,
            positions=self.points(trajectory.positions),
            quats_xyzw=geometry.multiply(turn, trajectory.quats_xyzw),
        )
