# SPDX-License-Identifier: MIT OR Apache-2.0
"""From the map to projected coordinates, exactly, and as a polynomial that is fast.

A projection bends and stretches: a UTM zone is up to 0.04 % too short and turned by degrees against
true north, and the plane of the map leaves the ellipsoid by 8 cm in a kilometre. All of that is in a
polynomial of the third degree over the extent of the map, whose error is measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.geodesy import LevelFrame, ProjectedSystem
    from bentwing.closing.georeference.placement import Placement

    Array = NDArray[np.float64]

MAX_ERROR = 1e-4  # m; if the polynomial is worse, every point is projected by pyproj
_POWERS = [p for p in product(range(4), repeat=3) if sum(p) <= 3]
_NODES = 7


@dataclass(frozen=True, slots=True)
class MapProjection:
    """Map coordinates to easting, northing and height.

    Attributes
    ----------
    frame, placement, system : the way from the map to the projected system
    middle, half : (3,) m, the box of map coordinates for which the polynomial is made
    coefficients : (20, 3)
    error : m, the largest found between the nodes
    """

    frame: LevelFrame
    placement: Placement
    system: ProjectedSystem
    middle: Array
    half: Array
    coefficients: Array
    error: float

    @classmethod
    def over(
        cls,
        low: Array,
        high: Array,
        frame: LevelFrame,
        placement: Placement,
        system: ProjectedSystem,
    ) -> MapProjection:
        """Make the polynomial for a box of map coordinates from `low` to `high` (3,)."""
        middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), 1.0)
        nodes = _grid(np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES))
        points = middle + half * nodes
        exact = system.from_geodetic(frame.to_geodetic(placement.to_level(points)))
        coefficients = np.asarray(np.linalg.lstsq(_terms(nodes), exact, rcond=None)[0], np.float64)
        made = cls(frame, placement, system, middle, half, coefficients, np.inf)
        between = middle + half * _grid(np.linspace(-1, 1, 6))
        error = float(np.abs(made._polynomial(between) - made.exact(between)).max())
        return cls(frame, placement, system, middle, half, coefficients, error)

    def to_projected(self, points: Array) -> Array:
        """Easting, northing, height (N, 3) m of map points (N, 3) m."""
        return self._polynomial(points) if self.error < MAX_ERROR else self.exact(points)

    def exact(self, points: Array) -> Array:
        """Return the same through pyproj, which takes about a microsecond for each."""
        level = self.placement.to_level(points)
        return self.system.from_geodetic(self.frame.to_geodetic(level))

    def to_map(self, projected: Array) -> Array:
        """Map points (N, 3) m of easting, northing, height (N, 3) m."""
        level = self.frame.from_geodetic(self.system.to_geodetic(projected))
        return self.placement.to_map(level)

    def _polynomial(self, points: Array) -> Array:
        values: Array = _terms((points - self.middle) / self.half) @ self.coefficients
        return values

    def record(self) -> dict[str, Any]:
        """Return what run.json says about it."""
        convergence, scale = self.system.factors(self.frame.longitude, self.frame.latitude)
        # The linear part, which is enough to show the map beside its trajectory.
        step = np.eye(3)
        first = self.exact(self.middle[None] - step)
        matrix = 0.5 * (self.exact(self.middle[None] + step) - first).T
        return {
            "epsg": self.system.epsg,
            "crs": self.system.name,
            "heights": self.system.heights,
            "origin": {
                "longitude": self.frame.longitude,
                "latitude": self.frame.latitude,
                "height": self.frame.height,
            },
            "heading": self.placement.heading,
            "translation": self.placement.translation,
            "std": self.placement.std_record(),
            "convergence_deg": convergence,
            "point_scale": scale,
            "polynomial_error": self.error,
            "linear": {
                "map": self.middle,
                "projected": self.exact(self.middle[None])[0],
                "matrix": matrix,
            },
        }


def _grid(steps: Array) -> Array:
    return np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)


def _terms(points: Array) -> Array:
    x, y, z = points.T
    powers = [[np.ones(len(points)), a, a * a, a * a * a] for a in (x, y, z)]
    return np.stack([powers[0][i] * powers[1][j] * powers[2][k] for i, j, k in _POWERS], axis=1)
