# SPDX-License-Identifier: MIT OR Apache-2.0
"""The coordinates a given map is in, where they are not those that it is compared in.

Surfaces are compared near the origin of a right-angled frame: those of a run in the frame of its trajectory, those
of a cloud in projected coordinates with some round kilometres taken off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.geodesy import ProjectedSystem
from bentwing.map.read import read_parts

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

# Nearer to the origin a cloud is left where it is, m.
_NEAR = 10_000.0
_ROUND = 1000.0


@dataclass(frozen=True, slots=True)
class GivenCoordinates:
    """A linear way from the frame of comparison to the coordinates of the map.

    Attributes
    ----------
    origin : (3,) m, there
    given : (3,) m, the same point as the map has it
    matrix : (3, 3)
    crs_wkt : what the map says about its coordinates, None if nothing
    record : of all that, for run.json
    """

    origin: NDArray[np.float64]
    given: NDArray[np.float64]
    matrix: NDArray[np.float64]
    crs_wkt: str | None
    record: dict[str, Any]

    def to_projected(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points (N, 3) m as the map has them."""
        given: NDArray[np.float64] = (points - self.origin) @ self.matrix.T + self.given
        return given


def coordinates_of_run(georeference: Mapping[str, Any] | None) -> GivenCoordinates | None:
    """Return those of a run's map; None if it is in the frame of its trajectory."""
    if not georeference:
        return None
    linear = {name: np.array(value) for name, value in georeference["linear"].items()}
    epsg = georeference.get("epsg")
    wkt = None if epsg is None else ProjectedSystem.of_epsg(int(epsg)).wkt
    return GivenCoordinates(
        linear["map"], linear["projected"], linear["matrix"], wkt, dict(georeference)
    )


def coordinates_of_cloud(path: Path) -> GivenCoordinates | None:
    """Return those of a cloud far from its origin; None if it can be left where it is."""
    first = next((part.points for part in read_parts(path) if len(part.points)), None)
    if first is None:
        return None
    middle = np.median(first, axis=0)
    if np.abs(middle).max() < _NEAR:
        return None
    shift, zero, straight = np.round(middle / _ROUND) * _ROUND, np.zeros(3), np.eye(3)
    linear = {"map": zero.tolist(), "projected": shift.tolist(), "matrix": straight.tolist()}
    return GivenCoordinates(zero, shift, straight, _wkt(path), {"linear": linear})


def _wkt(path: Path) -> str | None:
    if path.suffix.lower() not in {".las", ".laz"}:
        return None
    import laspy
    from laspy.vlrs.known import WktCoordinateSystemVlr

    with laspy.open(path) as file:
        found = [v.string for v in file.header.vlrs if isinstance(v, WktCoordinateSystemVlr)]
    return str(found[0]) if found else None
