# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether two places differ by what was moved in them, or are different places that are built alike.

A site on another day has its walls where they were, and most of what stands between them: boxes, cars, furniture.
A room that is built alike has the walls, and what stands between them elsewhere. In a wrong place beams of the one
pass through the walls of the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.transform import apply, inverse
from bentwing.closing.places.cloud import FLAT, is_plane

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.closing.places.cloud import Surfels
    from bentwing.closing.places.place import Place

# A wall goes on in its plane, farther than a car is long: so many surfels are in it between these distances, m.
_GOES_ON = ((2.2, 4.5, 3), (4.5, 8.0, 4))
# In one plane are surfels whose normals differ by little, and that are so far off the planes of each other, m: the
# nearer of the two, as the normal of half a metre of wall is a degree off, and the farther.
_PARALLEL = np.cos(np.radians(6.0))
_OFF_ONE, _OFF_OTHER = 0.1, 0.3
# What is so near a wall is part of it, m: a window, a door, a pipe; walls are looked for so far away, m.
_ON_WALL, _WALL_NEAR, _WALLS = 0.4, 3.0, 20
# A plane stands where it did if the other place has a plane there that differs by so little, m along and across it.
_BESIDE, _ACROSS, _NEIGHBOURS = 0.8, 0.06, 8
_SAME_FACE = np.cos(np.radians(20.0))
# A plane that differs by more than that, and less than this, is one that was moved a little.
_TURNED_FACE = np.cos(np.radians(45.0))


@dataclass(frozen=True, slots=True)
class Things:
    """What became of planes, of which a place has one in each voxel of half a metre.

    Planes of floors and ceilings, and those that the other place could not see, do not count.

    Attributes
    ----------
    kept, moved : of things, those that stand where they did, and those that do not
    walls, pierced : of walls, all, and those that stand where the other place saw through
    """

    kept: int
    moved: int
    walls: int
    pierced: int

    @property
    def share_kept(self) -> float:
        """Share of the things that stand where they did."""
        return self.kept / max(self.kept + self.moved, 1)

    @property
    def share_pierced(self) -> float:
        """Share of the walls that cannot be there."""
        return self.pierced / max(self.walls, 1)


def compare_things(a: Place, b: Place, T_a_b: NDArray[np.float64]) -> Things:
    """Compare the walls and the things of two places, given the transform (4, 4) from b to a."""
    of_a, of_b = _Planes.of(a.surfels), _Planes.of(b.surfels)
    views = [
        (_fate(a, of_a, of_b.walls, T_a_b), _fate(a, of_a, of_b.things, T_a_b)),
        (_fate(b, of_b, of_a.walls, inverse(T_a_b)), _fate(b, of_b, of_a.things, inverse(T_a_b))),
    ]
    walls, things = (sum(fates) for fates in zip(*views, strict=True))
    return Things(
        kept=int(things[0]),
        moved=int(things[1] + things[2]),
        walls=int(walls.sum()),
        pierced=int(walls[2]),
    )


@dataclass(frozen=True, slots=True)
class _Planes:
    """The upright planes of a place: all, those of walls, and those of what stands away from them."""

    every: Surfels
    walls: Surfels
    things: Surfels

    @classmethod
    def of(cls, surfels: Surfels) -> _Planes:
        planes = surfels[is_plane(surfels) & (np.abs(surfels.normals[:, 2]) < FLAT)]
        is_wall = _go_on(planes)
        walls, others = planes[is_wall], planes[~is_wall]
        return cls(planes, walls, others[~_are_on(walls, others)])


def _go_on(planes: Surfels) -> NDArray[np.bool_]:
    """Whether planes (P,) are part of one that is longer than things are."""
    first, second, distances = _in_one_plane(planes)
    on = np.ones(len(planes), dtype=np.bool_)
    for least, most, needed in _GOES_ON:
        ring = (distances > least) & (distances <= most)
        ends = np.concatenate([first[ring], second[ring]])
        on &= np.bincount(ends, minlength=len(planes)) >= needed
    return on


def _in_one_plane(
    planes: Surfels,
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """Find the pairs (K,) of planes that are parts of one, and their distances, m."""
    from scipy.spatial import cKDTree

    points, normals = planes.means, planes.normals
    reach = _GOES_ON[-1][1]
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray") if len(points) else []
    first, second = np.asarray(pairs, dtype=np.intp).reshape(-1, 2).T
    parallel = np.abs(np.einsum("ni,ni->n", normals[first], normals[second])) > _PARALLEL
    first, second = first[parallel], second[parallel]
    between = points[first] - points[second]
    off = [np.abs(np.einsum("ni,ni->n", between, normals[rows])) for rows in (first, second)]
    same = (np.minimum(*off) < _OFF_ONE) & (np.maximum(*off) < _OFF_OTHER)
    return first[same], second[same], np.linalg.norm(between[same], axis=1)


def _are_on(walls: Surfels, others: Surfels) -> NDArray[np.bool_]:
    """Whether other planes (P,) are on a wall or just before it."""
    near, columns = _around(walls.means, others.means, _WALLS, _WALL_NEAR)
    offsets = others.means[:, None] - walls.means[columns]
    off = np.abs(np.einsum("nki,nki->nk", offsets, walls.normals[columns]))
    return np.asarray((near & (off < _ON_WALL)).any(axis=1))


def _fate(
    place: Place, planes: _Planes, others: Surfels, T: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Count of the planes of another place, moved by `T`: those kept, moved a little, and seen through."""
    moved, normals = apply(T, others.means), others.normals @ T[:3, :3].T
    own = planes.every
    near, columns = _around(own.means, moved, _NEIGHBOURS, _BESIDE)
    cosines = np.einsum("nki,ni->nk", own.normals[columns], normals)
    # of a cloud nobody knows which side of a plane was seen
    cosines = cosines if own.signed and others.signed else np.abs(cosines)
    offsets = moved[:, None] - own.means[columns]
    across = np.abs(np.einsum("nki,nki->nk", offsets, own.normals[columns]))
    kept = (near & (cosines > _SAME_FACE) & (across < _ACROSS)).any(axis=1)
    through = np.zeros(len(moved), dtype=np.bool_)
    if place.free is not None:
        through = place.free.contains(moved) & ~kept
    shifted = (near & (cosines > _TURNED_FACE)).any(axis=1) & ~kept & ~through
    return np.array([kept.sum(), shifted.sum(), through.sum()])


def _around(
    points: NDArray[np.float64], at: NDArray[np.float64], k: int, reach: float
) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Find up to `k` of `points` (P, 3) within `reach` of `at` (N, 3): which there are, and rows (N, k)."""
    from scipy.spatial import cKDTree

    if not len(points) or not len(at):
        return np.zeros((len(at), 0), dtype=np.bool_), np.zeros((len(at), 0), dtype=np.intp)
    found = cKDTree(points).query(at, k=np.arange(1, k + 1), distance_upper_bound=reach)
    distances, rows = found
    near = np.isfinite(distances)
    return near, np.where(near, rows, 0)
