# SPDX-License-Identifier: MIT OR Apache-2.0
"""Bring a map to a reference: robust point-to-plane registration from any start."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.errors import InputError
from bentwing.base.voxels import voxel_keys
from bentwing.evaluate.alignment import Alignment
from bentwing.evaluate.coarse_placement import coarse_placements
from bentwing.evaluate.robust import scale, tukey

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.evaluate.surface import Surface

_COARSE_LIMITS = (2.0, 1.0, 0.5, 0.25)  # m; matches beyond are left out, step by step
_FINE_LIMITS = (0.5, 0.3)
_COARSE_POINTS, _EVEN_POINTS, _FINE_POINTS = 3_000, 30_000, 40_000
_ITERATIONS = 8  # per limit
_CONVERGED = 1e-6  # m and rad
_THINNED = 0.3  # m, edge of the voxels of an even density
_NEAR = 0.1  # m; the share of points nearer than this judges a placement
_LEAST_NEAR = 0.3
_FINEST_SIGMA = 1e-3  # m
_FEWEST = 50  # matches


def place(
    points: NDArray[np.float64],
    surface: Surface,
    starts: Sequence[Alignment] = (),
    coverage: float = 1.0,
) -> Alignment:
    """Find the rigid motion from a map to its reference.

    Parameters
    ----------
    points : (N, 3) m, an even sample of the map
    surface : the reference
    starts : placements to try besides those that the views from above suggest
    coverage : share of what the reference has seen that is on one of its discs

    Raises
    ------
    InputError
        If the map fits nowhere.

    References
    ----------
    Kaul 2015, section 4.2: a robust point-to-plane ICP.
    """
    even, seen = (
        _drawn(_thinned(cloud, _THINNED), _EVEN_POINTS)
        for cloud in (points, surface.surfels.centres)
    )
    few = _drawn(even, _COARSE_POINTS)
    candidates = [*starts, Alignment(np.eye(3), np.zeros(3)), *coarse_placements(even, seen)]
    refined = [refine(few, surface, start, _COARSE_LIMITS) for start in candidates]
    best = max(refined, key=lambda placement: share_near(few, surface, placement))
    many = _drawn(_thinned(points, 2 * surface.surfels.edge), _FINE_POINTS)
    found = refine(many, surface, best, _FINE_LIMITS)
    share = share_near(few, surface, found)
    least = _LEAST_NEAR * coverage
    if share < least:
        msg = (
            f"only {share:.1%} of the map come within {_NEAR:g} m of a surface of the reference map "
            f"wherever it is put, {least:.1%} are needed; are both of the same place, in metres, with z "
            "up?"
        )
        raise InputError(msg)
    return found


def refine(
    points: NDArray[np.float64], surface: Surface, start: Alignment, limits: Sequence[float]
) -> Alignment:
    """Register points to the discs by Gauss-Newton on distances along normals, Tukey's weights."""
    R, t = start.R, start.t
    for limit in limits:
        for _ in range(_ITERATIONS):
            placed = points @ R.T + t
            distances, discs = surface.distances(placed, limit)
            on = discs >= 0
            if np.count_nonzero(on) < _FEWEST:
                return Alignment(R, t)
            normals = surface.surfels.normals[discs[on]]
            step = _step(placed[on], normals, distances[on])
            turn = geometry.to_matrices(geometry.exp(step[:3]))
            R, t = turn @ R, turn @ t + step[3:]
            if np.abs(step).max() < _CONVERGED:
                break
    return Alignment(R, t)


def coverage_of(points: NDArray[np.float64], surface: Surface) -> float:
    """Share of the points of a cloud that lie on the discs that were fitted to it.

    Leaves, and walls that few beams have hit, make no disc; a map of the same place has them too.
    """
    few = _drawn(_thinned(points, _THINNED), _COARSE_POINTS)
    return share_near(few, surface, Alignment(np.eye(3), np.zeros(3)))


def share_near(points: NDArray[np.float64], surface: Surface, placement: Alignment) -> float:
    """Share of points within `_NEAR` of the reference."""
    distances, _ = surface.distances(placement.put(points), _NEAR)
    return float(np.mean(np.isfinite(distances)))


def _step(
    placed: NDArray[np.float64], normals: NDArray[np.float64], distances: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Rotation about the middle, given about the origin, and translation (6,)."""
    # about the middle of the points, so that far from the origin rotation and shift stay apart
    middle = placed.mean(axis=0)
    design = np.hstack([np.cross(placed - middle, normals), normals])
    weights = tukey(distances, max(scale(distances), _FINEST_SIGMA))
    weighted = design * weights[:, None]
    solution = np.linalg.pinv(weighted.T @ design, rcond=1e-10, hermitian=True) @ (
        weighted.T @ distances
    )
    turn = geometry.to_matrices(geometry.exp(solution[:3]))
    return np.append(solution[:3], middle + solution[3:] - turn @ middle)


def _thinned(points: NDArray[np.float64], edge: float) -> NDArray[np.float64]:
    _, first = np.unique(voxel_keys(points, edge), return_index=True)
    return points[np.sort(first)]


def _drawn(points: NDArray[np.float64], most: int) -> NDArray[np.float64]:
    if len(points) <= most:
        return points
    return points[np.sort(np.random.default_rng(0).choice(len(points), most, replace=False))]
