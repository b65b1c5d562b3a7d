# SPDX-License-Identifier: MIT OR Apache-2.0
"""Surveyed points, and the surfaces of the map around them.

A mark on the ground has no shape a lidar could see. What is measured is the surface around it: the
plane through the points of the map within `radius` of the mark, and the mark's distance from it
along the normal. A mark on a floor so tells the height, one on a wall the way across the wall.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.map.chunk import MapChunk

    Array = NDArray[np.float64]

MIN_POINTS = 20
MAX_POINTS = 40_000  # of one mark in memory
MIN_SPREAD = 0.1  # of the radius, across: points of one scan line have no normal
MIN_SIGMA = 0.003  # m; marks are not surveyed better
PICKED = 0.02  # m, to which a mark is found in a cloud
_TRIMMED = 3.0


Use: TypeAlias = Literal["control", "check"]
Kind: TypeAlias = Literal["surface", "sphere"]


@dataclass(frozen=True, slots=True)
class Standing:
    """When the carrier stood on a mark, and with what.

    Attributes
    ----------
    first, last : s since the recording's start
    foot : (3,) m, the point of the carrier that was on the mark, IMU frame
    """

    first: float
    last: float
    foot: Array


@dataclass(frozen=True, slots=True)
class ControlPoint:
    """A surveyed point.

    Attributes
    ----------
    name : of the mark
    position : (3,) m, easting, northing, height in the map's system; of a file in degrees longitude,
        latitude, height
    radius : m, of the surface around it that is flat, or of the sphere
    use : `control` points constrain the map, `check` points only tell how good it is
    picked : (3,) m, where the mark was seen in the map; None where nobody has said
    sigma : m, standard deviation of that place
    standing : when the carrier stood on the mark, which says where it is in the map
    kind : `surface` for a mark on one, `sphere` for the centre of a sphere
    """

    name: str
    position: Array
    radius: float
    use: Use
    picked: Array | None = None
    sigma: float = PICKED
    standing: Standing | None = None
    kind: Kind = "surface"


@dataclass(frozen=True, slots=True)
class Plane:
    """The surface around a mark: middle and normal (3,), thickness m, points, time of most of them."""

    middle: Array
    normal: Array
    thickness: float
    n_points: int
    time: float

    @property
    def sigma(self) -> float:
        """Standard deviation of the surface's place across, m."""
        return float(np.hypot(self.thickness / np.sqrt(self.n_points), MIN_SIGMA))


@dataclass(slots=True)
class Neighbourhood:
    """Points of the map around a mark, collected chunk by chunk.

    Attributes
    ----------
    middle : (3,) m, map frame, where the mark is expected
    reach : m, how far around it
    """

    middle: Array
    reach: float
    _points: list[Array] = field(default_factory=list)
    _times: list[Array] = field(default_factory=list)
    _n: int = 0

    def add(self, chunk: MapChunk) -> None:
        """Take what is near of a chunk."""
        inside = np.flatnonzero(np.abs(chunk.points[:, 0] - self.middle[0]) < self.reach)
        gaps = chunk.points[inside] - self.middle
        near = inside[np.einsum("ni,ni->n", gaps, gaps) < self.reach**2]
        if len(near):
            self._points.append(chunk.points[near])
            self._times.append(chunk.times[near])
            self._n += len(near)
        if self._n > 2 * MAX_POINTS:
            points, times = self.points[::2].copy(), self.times[::2].copy()
            self._points, self._times, self._n = [points], [times], len(points)

    @property
    def points(self) -> Array:
        """(N, 3) m, map frame."""
        return np.concatenate(self._points) if self._points else np.empty((0, 3))

    @property
    def times(self) -> Array:
        """(N,) s."""
        return np.concatenate(self._times) if self._times else np.empty(0)

    def replace(self, points: Array) -> None:
        """Move the points to where a corrected trajectory has them."""
        self._points, self._times = [points], [self.times]


def plane_around(
    points: Array, times: Array, mark: Array, radius: float, slack: float = 0.0
) -> Plane | None:
    """Find the plane through the points within a radius of a mark; None where there is none.

    Parameters
    ----------
    points : (N, 3) m
    times : (N,) s
    mark : (3,) m, in the same frame
    radius : m
    slack : m, by which the mark may be off along the normal
    """
    gaps = points - mark
    lengths = np.linalg.norm(gaps, axis=1)
    near = lengths < radius
    if np.count_nonzero(near) < MIN_POINTS:
        near = lengths < radius + slack
    for _ in range(4):
        if np.count_nonzero(near) < MIN_POINTS:
            return None
        chosen = points[near]
        middle = chosen.mean(axis=0)
        values, vectors = np.linalg.eigh(np.cov((chosen - middle).T))
        normal, thickness = vectors[:, 0], float(np.sqrt(max(values[0], 0.0)))
        heights = (points - middle) @ normal
        # The mark's foot on the plane is the middle of the patch, however far off the mark is.
        across = gaps - np.outer(gaps @ normal, normal)
        limit = max(_TRIMMED * thickness, 0.01)
        near = (np.linalg.norm(across, axis=1) < radius) & (np.abs(heights) < limit)
    n = int(np.count_nonzero(near))
    if n < MIN_POINTS or np.sqrt(max(values[1], 0.0)) < max(MIN_SPREAD * radius, 3 * thickness):
        return None
    chosen = points[near]
    middle = chosen.mean(axis=0)
    values, vectors = np.linalg.eigh(np.cov((chosen - middle).T))
    normal = vectors[:, 0] * (1.0 if vectors[2, 0] >= 0 else -1.0)
    thickness = float(np.sqrt(max(values[0], 0.0)))
    return Plane(middle, normal, thickness, n, float(np.median(times[near])))
