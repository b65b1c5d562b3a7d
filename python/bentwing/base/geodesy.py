# SPDX-License-Identifier: MIT OR Apache-2.0
"""Places on the Earth: a level frame at one of them, and projected coordinates, through pyproj.

Everything geodetic is WGS 84 with heights above the ellipsoid, as GNSS receivers deliver it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import UsageError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_GEODETIC, _GEOCENTRIC = 4979, 4978  # EPSG: WGS 84 in three dimensions


@dataclass(frozen=True, slots=True)
class LevelFrame:
    """East, north, up, m, in the plane that touches the ellipsoid's parallel at a place.

    Attributes
    ----------
    longitude, latitude : deg
    height : m above the ellipsoid
    """

    longitude: float
    latitude: float
    height: float

    def from_geodetic(self, places: Array) -> Array:
        """Coordinates (N, 3) m of longitudes, latitudes (deg) and heights (N, 3)."""
        offsets = _geocentric(places) - _geocentric(self._origin())
        coordinates: Array = offsets @ self._axes().T
        return coordinates

    def to_geodetic(self, points: Array) -> Array:
        """Longitudes, latitudes (deg) and heights (N, 3) of coordinates (N, 3) m."""
        geocentric = points @ self._axes() + _geocentric(self._origin())
        return _transformed(_GEOCENTRIC, _GEODETIC, geocentric)

    def _origin(self) -> Array:
        return np.array([[self.longitude, self.latitude, self.height]])

    def _axes(self) -> Array:
        """Return unit vectors east, north and up as rows (3, 3), geocentric."""
        lon, lat = np.radians([self.longitude, self.latitude])
        (sl, cl), (sp, cp) = ((np.sin(a), np.cos(a)) for a in (lon, lat))
        return np.array([[-sl, cl, 0.0], [-sp * cl, -sp * sl, cp], [cp * cl, cp * sl, sp]])


@dataclass(frozen=True, slots=True)
class ProjectedSystem:
    """A projected coordinate reference system in metres.

    Attributes
    ----------
    epsg : its code
    name : of it
    wkt : well-known text, version 1 as LAS wants it
    heights : what its heights are above, in words
    """

    epsg: int
    name: str
    wkt: str
    heights: str = "above the ellipsoid"

    @classmethod
    def of_epsg(cls, epsg: int) -> ProjectedSystem:
        """Look a system up.

        Raises
        ------
        UsageError
            If there is none of this code, it is not projected or not in metres, or its heights need files
            that are not there.
        """
        import pyproj

        try:
            crs = pyproj.CRS.from_epsg(epsg)
        except pyproj.exceptions.CRSError as error:
            msg = f"EPSG:{epsg} is not known ({error}); give the code of a projected system"
            raise UsageError(msg) from None
        if not crs.is_projected or any(a.unit_conversion_factor != 1.0 for a in crs.axis_info):
            msg = (
                f"EPSG:{epsg} ({crs.name}) is not projected in metres; give for example a UTM zone"
            )
            raise UsageError(msg)
        found = cls(epsg, crs.name, crs.to_wkt("WKT1_GDAL") or crs.to_wkt(), _heights(crs))
        if (area := crs.area_of_use) is not None:  # before the hours of work that come first
            width = (area.east - area.west) % 360.0  # some lie across the 180th meridian
            middle = [area.west + width / 2, (area.south + area.north) / 2, 0.0]
            found.from_geodetic(np.array([middle]))
        return found

    @classmethod
    def utm(cls, longitude: float, latitude: float) -> ProjectedSystem:
        """Return the UTM zone of a place, on WGS 84.

        Raises
        ------
        UsageError
            If there is none, as at the poles.
        """
        from pyproj.aoi import AreaOfInterest
        from pyproj.database import query_utm_crs_info

        area = AreaOfInterest(longitude, latitude, longitude, latitude)
        found = query_utm_crs_info(datum_name="WGS 84", area_of_interest=area)
        if not found:
            msg = f"no UTM zone at {latitude:.3f}° north, {longitude:.3f}° east; give --epsg"
            raise UsageError(msg)
        return cls.of_epsg(int(found[0].code))

    def from_geodetic(self, places: Array) -> Array:
        """Easting, northing and height (N, 3) m of longitudes, latitudes (deg) and heights."""
        return _transformed(_GEODETIC, self.epsg, places)

    def to_geodetic(self, points: Array) -> Array:
        """Longitudes, latitudes (deg) and heights (N, 3) of easting, northing and height."""
        return _transformed(self.epsg, _GEODETIC, points)

    def to(self, other: ProjectedSystem, points: Array) -> Array:
        """Return points (N, 3) m of this system in another one.

        Raises
        ------
        UsageError
            If heights of the other one need grid files that are not there.
        """
        return _transformed(self.epsg, other.epsg, points)

    def factors(self, longitude: float, latitude: float) -> tuple[float, float]:
        """Meridian convergence, deg (from true north to grid north, clockwise), and point scale."""
        import pyproj

        found = pyproj.Proj(self.epsg).get_factors(longitude, latitude)
        return float(found.meridian_convergence), float(found.meridional_scale)


def _geocentric(places: Array) -> Array:
    return _transformed(_GEODETIC, _GEOCENTRIC, places)


def _transformed(source: int, target: int, points: Array) -> Array:
    import pyproj

    try:
        # Without the files of a geoid, PROJ would take heights above the ellipsoid for those above the sea.
        transformer = pyproj.Transformer.from_crs(
            _solid(source), _solid(target), always_xy=True, only_best=True, allow_ballpark=False
        )
        x, y, z = np.asarray(points, np.float64).T
        columns = transformer.transform(x, y, z, errcheck=True)
    except pyproj.exceptions.ProjError as error:
        msg = (
            f"coordinates cannot be taken from EPSG:{source} to EPSG:{target} ({error}); a system "
            "with heights above the sea needs PROJ's grid files: choose one without, or install them with "
            "`pyproj sync`"
        )
        raise UsageError(msg) from None
    return np.stack(columns, axis=1)


def _heights(crs: Any) -> str:  # noqa: ANN401 - pyproj is imported where it is needed
    """Say what the heights of a system are above."""
    if crs.is_compound:
        return f"those of {crs.sub_crs_list[-1].name}"
    return f"above the ellipsoid ({crs.ellipsoid.name})"


def _solid(epsg: int) -> Any:  # noqa: ANN401 - pyproj is imported where it is needed
    """Return a system with heights; those of a flat one are above the ellipsoid."""
    import pyproj

    crs = pyproj.CRS.from_epsg(epsg)
    return crs.to_3d() if len(crs.axis_info) == 2 else crs
