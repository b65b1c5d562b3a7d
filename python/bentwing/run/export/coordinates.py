# SPDX-License-Identifier: MIT OR Apache-2.0
"""The coordinates a run's map is written in, from its record: to them, back, and on to other systems."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.base.geodesy import LevelFrame, ProjectedSystem
from bentwing.closing.georeference.placement import Placement
from bentwing.closing.georeference.projection import MapProjection
from bentwing.closing.localize.coordinates import coordinates_of_run

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from bentwing.closing.localize import GivenCoordinates

    Array = NDArray[np.float64]
    Change = Callable[[Array], Array]


@dataclass(frozen=True, slots=True)
class Coordinates:
    """Where a run's map is.

    Attributes
    ----------
    exact : the way to projected coordinates, of a run with fixes of its own
    linear : the way to those of a prior map or of control points; of other runs nearly the exact one
    system : the projected system, where it has a name
    """

    exact: MapProjection | None = None
    linear: GivenCoordinates | None = None
    system: ProjectedSystem | None = None

    @classmethod
    def of_record(cls, record: Mapping[str, Any], low: Array, high: Array) -> Coordinates:
        """Return the coordinates of a run.

        Parameters
        ----------
        record : of the run
        low, high : (3,) m, corners of a box that has the map in it, frame of the trajectory
        """
        placed = record.get("georeference")
        if not placed:
            return cls()
        system = None if placed.get("epsg") is None else ProjectedSystem.of_epsg(placed["epsg"])
        if system is None or "origin" not in placed or record.get("localization"):
            return cls(None, coordinates_of_run(placed), system)
        origin, std = placed["origin"], placed["std"]
        frame = LevelFrame(origin["longitude"], origin["latitude"], origin["height"])
        placement = Placement(
            placed["heading"],
            np.array(placed["translation"], np.float64),
            np.array([std["heading"], *std["translation"]], np.float64),
        )
        exact = MapProjection.over(low, high, frame, placement, system)
        return cls(exact, coordinates_of_run(placed), system)

    def written(self, points: Array) -> Array:
        """Coordinates (N, 3) m in the map of points (N, 3) m in the frame of the trajectory."""
        if self.exact is not None:
            return self.exact.to_projected(points)
        return points if self.linear is None else self.linear.to_projected(points)

    def local(self, points: Array) -> Array:
        """Points (N, 3) m in the frame of the trajectory of coordinates (N, 3) m in the map."""
        return self.nearly_local(points) if self.exact is None else self.exact.to_map(points)

    def nearly_local(self, points: Array) -> Array:
        """Return the same to some millimetres in 300 m, without pyproj."""
        if self.linear is None:
            return points
        inverse = np.linalg.inv(self.linear.matrix)
        local: Array = (points - self.linear.given) @ inverse.T + self.linear.origin
        return local

    def degrees(self, points: Array) -> Array:
        """Longitudes, latitudes and heights (N, 3) of points (N, 3) m in the frame of the trajectory.

        Raises
        ------
        UsageError
            If nothing says where on the Earth the run is.
        """
        return self._system().to_geodetic(self.written(points))

    def target(self, *, epsg: int | None = None, local: bool = False) -> Target:
        """Return the coordinates an export has: those of the map unless said otherwise.

        Parameters
        ----------
        epsg : of another projected system
        local : the frame of the trajectory instead

        Raises
        ------
        UsageError
            If both are wanted, or nothing says where on the Earth the run is.
        """
        if local and epsg is not None:
            msg = f"EPSG:{epsg} and the frame of the trajectory cannot both be written; give one"
            raise UsageError(msg)
        if local:
            return Target(None, self.local, same)
        if epsg is None or (self.system is not None and epsg == self.system.epsg):
            return Target(self.system, same, self.written)
        own, other = self._system(), ProjectedSystem.of_epsg(epsg)
        return Target(other, lambda p: own.to(other, p), lambda p: own.to(other, self.written(p)))

    def _system(self) -> ProjectedSystem:
        if self.system is None:
            msg = (
                "the run does not know where on the Earth it is; map it with GNSS fixes, or with "
                "control points and --epsg"
            )
            raise UsageError(msg)
        return self.system


@dataclass(frozen=True, slots=True)
class Target:
    """The coordinates an export has.

    Attributes
    ----------
    system : None for a frame without a name
    from_map, from_local : take points (N, 3) m to them, from those of the map and of the trajectory
    """

    system: ProjectedSystem | None
    from_map: Change
    from_local: Change

    @property
    def crs_wkt(self) -> str | None:
        """The system as LAS wants it."""
        return None if self.system is None else self.system.wkt


def same(points: Array) -> Array:
    """Return points as they are."""
    return points
