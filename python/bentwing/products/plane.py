# SPDX-License-Identifier: MIT OR Apache-2.0
"""Planes that cut a map, and what of it lies near them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.arguments import finite_array
from bentwing.base.moments import VoxelMoments
from bentwing.base.value import Value
from bentwing.base.voxels import by_key, voxel_keys

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike, NDArray

CELL = 0.01
"""m, edge of the cells in which the points of a section are gathered."""
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class CutPlane(Value):
    """A plane, and how a drawing of it lies.

    Attributes
    ----------
    origin : (3,) m, the drawing's zero
    across, up : (3,) unit vectors to the right and upwards; their cross product points to the viewer
    length : m, of what is drawn from the origin to the right; infinite for the whole plane
    """

    origin: NDArray[np.float64]
    across: NDArray[np.float64]
    up: NDArray[np.float64]
    length: float = np.inf

    @classmethod
    def level(cls, height: float) -> CutPlane:
        """Return the level plane at a height, m, seen from above with x to the right."""
        return cls(np.array([0.0, 0.0, height]), np.eye(3)[0], np.eye(3)[1])

    @classmethod
    def upright(cls, first: ArrayLike, last: ArrayLike) -> CutPlane:
        """Return the upright plane from one point (2,) m to another, seen with the first at the left.

        Raises
        ------
        ValueError
            If the points are the same.
        """
        start, end = finite_array("first", first, 2), finite_array("last", last, 2)
        length = float(np.linalg.norm(end - start))
        if length == 0.0:
            msg = f"last: expected another point than {start.tolist()}, got the same"
            raise ValueError(msg)
        return cls(np.append(start, 0.0), np.append((end - start) / length, 0.0), _UP, length)

    @classmethod
    def through(cls, point: ArrayLike, normal: ArrayLike) -> CutPlane:
        """Return the plane through a point (3,) m, seen against its normal (3,), across lying level.

        Raises
        ------
        ValueError
            If the normal has no length.
        """
        origin, toward = finite_array("point", point, 3), finite_array("normal", normal, 3)
        if not np.linalg.norm(toward):
            msg = "normal: expected a direction, got a vector without length"
            raise ValueError(msg)
        toward = toward / np.linalg.norm(toward)
        across = np.cross(_UP, toward)
        if np.linalg.norm(across) < 1e-9:  # a level plane
            across = np.eye(3)[0]
        across = across / np.linalg.norm(across)
        return cls(origin, across, np.cross(toward, across))

    @property
    def is_level(self) -> bool:
        """Whether it is a plan."""
        return abs(float(np.cross(self.across, self.up)[2])) > 1 - 1e-9

    def coordinates(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return across, up and toward the viewer (N, 3) m of points (N, 3) m, or of one."""
        axes = np.stack([self.across, self.up, np.cross(self.across, self.up)])
        local: NDArray[np.float64] = np.atleast_2d(points - self.origin) @ axes.T
        return local

    def points_at(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the points (N, 3) m of places (N, 2) m in the drawing."""
        points: NDArray[np.float64] = self.origin + places @ np.stack([self.across, self.up])
        return points


@dataclass(frozen=True, slots=True, eq=False)
class Slab(Value):
    """The points near a plane, gathered in cells of `CELL`.

    Attributes
    ----------
    places : (K, 2) m, mean of the points of a cell, across and up
    counts : (K,) int64, points of a cell
    """

    places: NDArray[np.float64]
    counts: NDArray[np.int64]

    @property
    def n_points(self) -> int:
        """Of all cells."""
        return int(self.counts.sum())

    def at_most(self, n: int) -> Slab:
        """Return the same in cells so large that there are at most `n` of them."""
        slab, edge = self, CELL
        while len(slab.counts) > n:
            edge *= 2.0
            flat = np.column_stack([slab.places, np.zeros(len(slab.places))])
            order, starts = by_key(voxel_keys(flat, edge))
            counts = np.add.reduceat(slab.counts[order], starts)
            sums = np.add.reduceat((slab.places * slab.counts[:, None])[order], starts)
            slab = Slab(sums / counts[:, None], counts)
        return slab


def cut(parts: Iterable[NDArray[np.float64]], plane: CutPlane, thickness: float) -> Slab:
    """Gather the points within half a thickness of a plane.

    Parameters
    ----------
    parts : (N, 3) m each, of a cloud that is never in memory as a whole
    plane : in the frame of the points
    thickness : m, of the slab
    """
    moments = VoxelMoments(CELL)
    for points in parts:
        local = plane.coordinates(points)
        inside = np.abs(local[:, 2]) <= thickness / 2
        if np.isfinite(plane.length):
            inside &= (local[:, 0] >= 0) & (local[:, 0] <= plane.length)
        moments.add(local[inside] * [1.0, 1.0, 0.0])
    found = moments.result()
    return Slab(np.ascontiguousarray(found.means[:, :2]), found.counts)
