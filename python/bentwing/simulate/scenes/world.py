# SPDX-License-Identifier: MIT OR Apache-2.0
"""A scene with what is needed to fly in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing._core import Scene

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.scenes.mesh import Mesh

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Survey:
    """A flight on a line that begins and ends in the air.

    Attributes
    ----------
    way_points : m; a single one is where the carrier stands still
    speed : m/s
    pitch : rad, of a carrier that stands still
    """

    way_points: tuple[Point, ...]
    speed: float
    pitch: float = 0.0


@dataclass(frozen=True, slots=True)
class Site:
    """What a scene's builder returns.

    Attributes
    ----------
    mesh : its surfaces
    low, high : corners of the box in which to fly, m
    pad_below : m, highest ground from which to take off
    speed : m/s, at which one flies here
    survey : the line to fly instead of a tour through the box, where there is one
    route : corners of a closed way, m, that a tour follows here instead of choosing its own
    road : points on the ground, m, along which a car drives
    spheres : centres, m, of those that stand as control marks
    """

    mesh: Mesh
    low: Point
    high: Point
    pad_below: float
    speed: float
    survey: Survey | None = None
    route: tuple[Point, ...] = ()
    road: tuple[Point, ...] = ()
    spheres: tuple[Point, ...] = ()


class World:
    """A site that can be asked for ranges and clearances."""

    def __init__(self, site: Site) -> None:
        self.site = site
        self.scene = Scene(site.mesh.vertices, site.mesh.triangles)
        self.normals = face_normals(site.mesh)

    def clearance(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance from `points` (N, 3) to the nearest surface, m."""
        return abs(self.scene.distance(points)[0])


def face_normals(mesh: Mesh) -> NDArray[np.float64]:
    """Return unit normals (T, 3); zero for triangles without area."""
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    unit: NDArray[np.float64] = normals / np.where(length > 0, length, 1.0)
    return unit
