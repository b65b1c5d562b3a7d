# SPDX-License-Identifier: MIT OR Apache-2.0
"""Evenly spaced points of a finished map, with normals that point to where the sensor was."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import InputError, UsageError
from bentwing.base.progress import Progress
from bentwing.base.value import Value
from bentwing.map.normals import SPACING, find_normals
from bentwing.map.voxel_views import VoxelViews
from bentwing.products.finished_map import open_map_of
from bentwing.products.map_chunks import chunks_of

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.map.chunk import MapChunk
    from bentwing.map.voxel_views import Views
    from bentwing.products.finished_map import FinishedMap

    Array = NDArray[np.float64]

_AGREEING = 0.5  # length of the mean of a voxel's normals; of both sides of a wall it is shorter
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
        has_normals = False
        for chunk in chunks_of(source):
            has_normals = chunk.normals is not None
            towards = _towards(source, chunk)
            seen = np.isfinite(towards[:, 0])
            gathered.add(chunk.where(seen), towards[seen])
    views = gathered.result()
    if views is None:
        msg = (
            f"{source.path}: nothing says from where its points were seen, because it has no times "
            "or the run no trajectory, or because runs overlap in time; give a run of `bentwing map`"
        )
        raise InputError(msg)
    with progress.stage("finding normals"):
        found = _means(views) if has_normals else find_normals(views, gathered.edge)
    normals, known = found
    if not known.any():
        msg = f"{source.path}: its points lie on no surface; give a larger --spacing"
        raise InputError(msg)
    intensity = None if views.intensity is None else views.intensity[known]
    return OrientedPoints(views.points[known], normals[known], intensity, gathered.edge)


def _towards(source: FinishedMap, chunk: MapChunk) -> Array:
    """Return the normals (N, 3) of a map that has them, else the directions to the sensor; NaN where unknown."""
    if chunk.normals is not None:
        return chunk.normals.astype(np.float64)
    return -source.beams_of(chunk)


def _means(views: Views) -> tuple[Array, NDArray[np.bool_]]:
    """Return the normals (K, 3) of voxels by those of their points, and where these agree (K,)."""
    lengths = np.linalg.norm(views.towards, axis=1)
    return views.towards / np.maximum(lengths, 1e-9)[:, None], lengths > _AGREEING
