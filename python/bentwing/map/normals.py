# SPDX-License-Identifier: MIT OR Apache-2.0
"""Normals of a map's points, towards the sensor: of the planes through the means of the voxels around."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.array_spool import ArraySpool, columns_of
from bentwing.base.memory import give_back
from bentwing.base.moments import Planes
from bentwing.base.search_tree import nearest
from bentwing.base.voxels import voxel_keys
from bentwing.map.chunk import MapChunk, beams_of
from bentwing.map.voxel_views import VoxelViews
from bentwing.map.writer import round_offset

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable
    from pathlib import Path

    from numpy.typing import NDArray
    from scipy.spatial import cKDTree

    from bentwing.map.voxel_views import Views

    Array = NDArray[np.float64]

SPACING = 0.05  # m
_NEIGHBOURS = range(1, 17)  # the point among them
_FEWEST = 6  # of them that say where a surface lies
_ENOUGH = 10.0  # points of a voxel, beyond which its mean gets no better by more
_REACH = 4.0  # spacings, to the farthest of them
_TOGETHER = 100_000  # points whose neighbours are in memory at once
_STEP = 1.0  # m along a normal, which says where it points in other coordinates


def with_normals(chunks: Iterable[MapChunk], folder: Path) -> Generator[MapChunk, None, None]:
    """Give every point the normal of its voxel, towards the lidar that measured it.

    All chunks pass once before the first one comes out; meanwhile they are on the disk.

    Parameters
    ----------
    chunks : with the beams of their points; NaN where nobody knows from where a point was seen
    folder : of the temporary file, about 60 bytes per point

    Yields
    ------
    The chunks with `normals`, NaN where too few points around say how the surface lies.
    """
    gathered = VoxelViews(SPACING)
    origin = np.zeros(3)  # of projected coordinates, which are too large for voxels
    with ArraySpool(folder) as spool:
        for number, chunk in enumerate(filter(len, chunks)):
            origin = origin if number else round_offset(chunk.points)
            towards = -beams_of(chunk).astype(np.float64)
            seen = np.isfinite(towards[:, 0])
            near = replace(chunk, points=chunk.points - origin)
            gathered.add(near.where(seen), towards[seen])
            spool.add(columns_of(chunk))
        views = gathered.result()
        keys, normals = np.empty(0, np.int64), np.empty((0, 3))
        if views is not None:
            found, known = find_normals(views, gathered.edge)
            keys, normals = views.keys[known], found[known]
        edge = gathered.edge
        del views, gathered
        give_back()
        for columns in spool.tables():
            chunk = MapChunk(**columns)
            of_points = voxel_keys(chunk.points - origin, edge)
            yield replace(chunk, normals=_of_voxels(keys, normals, of_points, beams_of(chunk)))


def _of_voxels(
    keys: NDArray[np.int64], normals: Array, wanted: NDArray[np.int64], beams: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return the normals (N, 3) of the voxels of points; both sides of a thin wall may share a voxel."""
    found = np.full((len(wanted), 3), np.nan, np.float32)
    if not len(keys):
        return found
    rows = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    known = keys[rows] == wanted
    found[known] = normals[rows[known]]
    found[np.einsum("ni,ni->n", found, beams) > 0.0] *= -1.0
    return found


def find_normals(views: Views, spacing: float) -> tuple[Array, NDArray[np.bool_]]:
    """Return normals (K, 3) towards the sensor, and where enough neighbours say which (K,).

    Neighbours that were seen from the opposite direction are of the other side of a thin wall.
    """
    from scipy.spatial import cKDTree  # slow to import, and few maps have normals

    tree = cKDTree(views.points)
    normals, known = np.empty_like(views.points), np.empty(len(views.points), np.bool_)
    for first in range(0, len(normals), _TOGETHER):
        rows = slice(first, first + _TOGETHER)
        normals[rows], known[rows] = _normals(tree, views, rows, _REACH * spacing)
    return normals, known


def _normals(
    tree: cKDTree, views: Views, rows: slice, reach: float
) -> tuple[Array, NDArray[np.bool_]]:
    points, towards = views.points[rows], views.towards[rows]
    distances, near = nearest(tree, points, _NEIGHBOURS, reach)
    there = np.isfinite(distances)
    near = np.where(there, near, 0)
    there &= np.einsum("nki,ni->nk", views.towards[near], towards) > 0.0
    # A voxel that the surface only touches has few points, whose mean is as uncertain.
    weights = np.where(there, np.minimum(views.counts[near], _ENOUGH), 0.0)
    weights /= np.maximum(weights.sum(axis=1), 1e-9)[:, None]
    offsets = np.where(there[..., None], views.points[near] - points[:, None], 0.0)
    centred = offsets - np.einsum("nk,nki->ni", weights, offsets)[:, None]
    covariances = np.einsum("nk,nki,nkj->nij", weights, centred, centred, optimize=True)
    normals = Planes.of(covariances).normals
    away = np.einsum("ni,ni->n", normals, towards) < 0.0
    normals[away] *= -1.0
    return normals, there.sum(axis=1) >= _FEWEST


def moved(chunk: MapChunk, change: Callable[[Array], Array]) -> MapChunk:
    """Return a chunk in other coordinates, its normals turned as they are there.

    Parameters
    ----------
    change : from points (N, 3) m to points (N, 3) m of coordinates that keep angles
    """
    points = change(chunk.points)
    if chunk.normals is None:
        return replace(chunk, points=points)
    known = np.isfinite(chunk.normals[:, 0])
    normals = np.full_like(chunk.normals, np.nan)
    ends = change(chunk.points[known] + _STEP * chunk.normals[known].astype(np.float64))
    turned = ends - points[known]
    normals[known] = turned / np.linalg.norm(turned, axis=1, keepdims=True)
    return replace(chunk, points=points, normals=normals)
