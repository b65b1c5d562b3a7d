# SPDX-License-Identifier: MIT OR Apache-2.0
"""A map against a reference map: a terrestrial scan, or the true surface."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import InputError
from bentwing.base.voxels import VoxelSet, voxel_keys
from bentwing.evaluate.alignment import Alignment
from bentwing.evaluate.clouds import Cloud
from bentwing.evaluate.map import surface_error
from bentwing.evaluate.placement import coverage_of, place
from bentwing.evaluate.spacing import PointSpacing, point_spacing
from bentwing.evaluate.statistics import SAMPLES
from bentwing.evaluate.surface import Surface
from bentwing.evaluate.surfels import Surfels, surfels_of_cloud, surfels_of_mesh
from bentwing.map.read_mesh import read_mesh

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory

THRESHOLD = 0.3  # m, of the paper: what is farther away has changed between the measurements
_EDGES = (0.1, 0.5)  # m, least and greatest distance between surfels
_SPACINGS = 10.0  # of the points of the reference, between surfels: two dozen points in each
_FEWEST_SURFELS = 100
_VIEWPOINTS_APART = 0.1  # m


@dataclass(frozen=True, slots=True)
class Reference:
    """A reference map.

    Attributes
    ----------
    surfels : relative to the origin
    origin : (3,) m
    spacing : of its points; None for a mesh
    is_mesh : whether it is a mesh
    coverage : share of its points that is on its surfels
    """

    surfels: Surfels
    origin: NDArray[np.float64]
    spacing: PointSpacing | None
    is_mesh: bool
    coverage: float = 1.0


@dataclass(frozen=True, slots=True)
class MapError:
    """Distances of a map from a reference along the reference's normals.

    Positive is behind the reference, as a range that is too long; negative is in front of it.

    Attributes
    ----------
    mean, std : m, of the points within the threshold
    median, robust_std : m, of the same; the latter from the median absolute deviation
    threshold : m; points farther away have changed or have no reference, and are left out
    n_points, n_measured, n_left_out : of the even sample that was measured
    completeness : share of the reference's surfels with a map point within `surfel_edge`
    surfel_edge : m, distance between the surfels
    n_surfels : of the reference
    front : what the front of a surface faces: `sensor`, or `middle` of the reference where the
        path of the sensor is not known
    R_reference_map, t_reference_map : found placement of the map in the reference's frame
    points, distances : (N, 3) m in the frame of the reference less `origin`, and (N,) m
    viewpoints : (M, 3) m in the same frame, places of the sensor, or the middle
    origin : (3,) m
    """

    mean: float
    std: float
    median: float
    robust_std: float
    threshold: float
    n_points: int
    n_measured: int
    n_left_out: int
    completeness: float
    surfel_edge: float
    n_surfels: int
    front: str
    R_reference_map: list[list[float]]
    t_reference_map: list[float]
    points: NDArray[np.float64] = field(metadata=SAMPLES)
    distances: NDArray[np.float64] = field(metadata=SAMPLES)
    viewpoints: NDArray[np.float64] = field(metadata=SAMPLES)
    origin: NDArray[np.float64] = field(metadata=SAMPLES)


def read_reference(path: Path) -> Reference:
    """Read a cloud or a PLY mesh and make its surfels.

    Raises
    ------
    InputError
        If the file cannot be read or has too few flat surfaces.
    """
    mesh = read_mesh(path)
    if mesh is not None:
        origin = np.round(np.median(mesh.vertices, axis=0))
        found = Reference(surfels_of_mesh(mesh, origin, _EDGES[0]), origin, None, is_mesh=True)
    else:
        cloud = Cloud(path)
        spacing = point_spacing(cloud)
        apart = 0.0 if spacing is None else _SPACINGS * spacing.median
        edge = float(np.clip(apart, *_EDGES))
        surfels = surfels_of_cloud(cloud.parts(), edge)
        found = Reference(surfels, cloud.origin, spacing, is_mesh=False)
        if len(surfels):
            coverage = coverage_of(cloud.sample.points, Surface(surfels))
            found = replace(found, coverage=coverage)
    if len(found.surfels) < _FEWEST_SURFELS:
        msg = (
            f"{path}: has {len(found.surfels)} flat pieces of {found.surfels.edge:.2f} m, "
            f"{_FEWEST_SURFELS} are needed; give a denser cloud, or a mesh, with metres as unit"
        )
        raise InputError(msg)
    return found


def compare_with_map(
    cloud: Cloud,
    reference: Reference,
    *,
    path: Trajectory | None = None,
    threshold: float = THRESHOLD,
    starts: Sequence[Alignment] = (),
) -> MapError:
    """Register a map to a reference and measure how far it is from it.

    Parameters
    ----------
    cloud : the map
    reference : its reference
    path : of the sensor in the map; tells front and back of a surface
    threshold : m
    starts : motions from the map to the reference's frame from which to try as well

    References
    ----------
    Kaul 2015, section 4.2, figures 21 and 22.
    """
    surface = Surface(reference.surfels)
    near = [_between_origins(start, cloud.origin, reference.origin) for start in starts]
    placement = place(cloud.sample.points, surface, near, reference.coverage)
    R, t = placement.R, placement.t
    viewpoints = _viewpoints(path, cloud, reference, placement)
    surface = surface.facing(viewpoints)
    points = cloud.sample.points @ R.T + t
    distances, _ = surface.distances(points, threshold)
    measured = np.isfinite(distances)
    points, distances = points[measured], distances[measured]
    robust = surface_error(distances, limit=threshold)
    whole = Alignment(R, t + reference.origin - R @ cloud.origin)
    return MapError(
        mean=float(distances.mean()),
        std=float(distances.std()),
        median=robust.bias,
        robust_std=robust.std,
        threshold=threshold,
        n_points=len(measured),
        n_measured=len(distances),
        n_left_out=len(measured) - len(distances),
        completeness=_completeness(cloud, surface, placement),
        surfel_edge=surface.surfels.edge,
        n_surfels=len(surface.surfels),
        front="middle" if path is None else "sensor",
        R_reference_map=whole.R.tolist(),
        t_reference_map=whole.t.tolist(),
        points=points,
        distances=distances,
        viewpoints=viewpoints,
        origin=reference.origin,
    )


def _between_origins(
    start: Alignment, own: NDArray[np.float64], other: NDArray[np.float64]
) -> Alignment:
    return Alignment(start.R, start.t + start.R @ own - other)


def _viewpoints(
    path: Trajectory | None, cloud: Cloud, reference: Reference, placement: Alignment
) -> NDArray[np.float64]:
    if path is None:
        return np.median(reference.surfels.centres, axis=0, keepdims=True)
    positions = path.positions - cloud.origin
    _, first = np.unique(voxel_keys(positions, _VIEWPOINTS_APART), return_index=True)
    return placement.put(positions[first])


def _completeness(cloud: Cloud, surface: Surface, placement: Alignment) -> float:
    """Share of the discs that the whole map, not its sample, has reached."""
    edge = surface.surfels.edge
    seen, filled = np.zeros(len(surface.surfels), np.bool_), VoxelSet()
    for part in cloud.parts():
        # one point per voxel of half the edge reaches the same discs as all of them, nearly
        points = placement.put(part)
        seen[surface.within(points[filled.add(voxel_keys(points, edge / 2))], edge)] = True
    return float(seen.mean())
