# SPDX-License-Identifier: MIT OR Apache-2.0
"""Evenly spaced points of a finished map, with normals that point to where the sensor was."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from bentwing.base.errors import InputError, UsageError
from bentwing.base.moments import Planes
from bentwing.base.progress import Progress
from bentwing.base.value import Value
from bentwing.products.finished_map import open_map_of
from bentwing.products.map_chunks import chunks_of
from bentwing.products.views import VoxelViews

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.products.finished_map import FinishedMap
    from bentwing.products.views import Views

    Array = NDArray[np.float64]

SPACING = 0.05  # m
_NEIGHBOURS = 16
_FEWEST = 6  # of them, the point among them, that say where a surface lies
_REACH = 4.0  # spacings, to the farthest of them
_TOGETHER = 100_000  # points whose neighbours are in memory at once
_SMALLEST = 0.001  # m; voxels of less than a millimetre hold less than a point each


@dataclass(frozen=True, slots=True, eq=False)
class OrientedPoints(Value):
    """Means of the points in voxels, with normals.

    Attributes
    ----------
    points : (K, 3) float64, m
    normals : (K, 3) float64, unit, towards the sensor
    intensity : (K,) float64, mean as the map's file has it; None where it has none
    spacing : m, edge of the voxels
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    intensity: NDArray[np.float64] | None
    spacing: float


def oriented_points(
    run: Path | str, *, spacing: float = SPACING, progress: Progress | None = None
) -> OrientedPoints:
    """Thin the map of a finished run, and find normals that point to where the sensor was.

    Parameters
    ----------
    run : folder that `map`, `merge` or `localize` has written
    spacing : m, edge of the voxels, each of which gives one point; doubled as often as it takes to
        have no more than two million voxels

    Returns
    -------
    In the coordinates of the map's file.

    Raises
    ------
    UsageError
        If the folder holds no complete run, or the spacing cannot be used.
    InputError
        If there is no map, or nothing says from where its points were seen.
    """
    source = open_map_of(run)
    found = orient(source, spacing, progress or Progress())
    return replace(found, points=found.points + source.origin)


def orient(source: FinishedMap, spacing: float, progress: Progress) -> OrientedPoints:
    """Thin a map and find normals, in coordinates relative to its origin; see `oriented_points`."""
    if not _SMALLEST <= spacing < np.inf:
        msg = f"--spacing {spacing} cannot be used; give a length in metres, at least {_SMALLEST}"
        raise UsageError(msg)
    gathered = VoxelViews(spacing)
    with progress.stage("thinning the map"):
        for chunk in chunks_of(source):
            sensors = source.sensors_at(chunk.times)
            seen = np.isfinite(sensors[:, 0])
            gathered.add(chunk.where(seen), sensors[seen])
    views = gathered.result()
    if views is None:
        msg = (
            f"{source.path}: nothing says from where its points were seen, because it has no times "
            "or the run no trajectory, or because runs overlap in time; give a run of `bentwing map`"
        )
        raise InputError(msg)
    with progress.stage("finding normals"):
        normals, known = find_normals(views, gathered.edge)
    if not known.any():
        msg = f"{source.path}: its points lie on no surface; give a larger --spacing"
        raise InputError(msg)
    intensity = None if views.intensity is None else views.intensity[known]
    return OrientedPoints(views.points[known], normals[known], intensity, gathered.edge)


def find_normals(views: Views, spacing: float) -> tuple[Array, NDArray[np.bool_]]:
    """Return normals (K, 3) towards the sensor, and where enough neighbours say which (K,).

    Neighbours that were seen from the opposite direction are of the other side of a thin wall.
    """
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
    distances, near = tree.query(points, _NEIGHBOURS, distance_upper_bound=reach)
    there = np.isfinite(distances)
    near = np.where(there, near, 0)
    there &= np.einsum("nki,ni->nk", views.towards[near], towards) > 0.0
    n = there.sum(axis=1)
    offsets = np.where(there[..., None], views.points[near] - points[:, None], 0.0)
    share = 1.0 / np.maximum(n, 1)
    centred = offsets - (offsets.sum(axis=1) * share[:, None])[:, None]
    centred[~there] = 0.0
    covariances = np.einsum("nki,nkj->nij", centred, centred) * share[:, None, None]
    normals = Planes.of(covariances).normals
    away = np.einsum("ni,ni->n", normals, towards) < 0.0
    normals[away] *= -1.0
    return normals, n >= _FEWEST
