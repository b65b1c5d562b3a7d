# SPDX-License-Identifier: MIT OR Apache-2.0
"""The surface of a finished map as triangles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np
from scipy.spatial import cKDTree

from bentwing.base.errors import InputError, UsageError
from bentwing.base.new_file import require_new
from bentwing.base.progress import Progress
from bentwing.base.value import Value
from bentwing.map.normals import SPACING
from bentwing.products.finished_map import open_map_of
from bentwing.products.mesh_files import MESH_SUFFIXES, write_triangles
from bentwing.products.names import MeshColour
from bentwing.products.open3d_package import require_open3d
from bentwing.products.oriented import orient
from bentwing.report.colours import HEIGHT
from bentwing.report.colours import colour as colour_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.products.finished_map import FinishedMap
    from bentwing.products.oriented import OrientedPoints

    Array = NDArray[np.float64]

_MARGIN = 1.1  # edge of the octree's cube by that of the points
_DEEPEST = 13  # levels of the octree
_SPARSER = 1.5  # levels of the octree: the points are 2.8 times as far apart as usually
_BLENDED = 4  # points that give a vertex its intensity
_ENDS = (2.0, 98.0)  # %, of the values at the ends of the colours


@dataclass(frozen=True, slots=True, eq=False)
class Mesh(Value):
    """Triangles between coloured vertices, counter-clockwise as the sensor saw them.

    Attributes
    ----------
    vertices : (V, 3) float64, m
    triangles : (T, 3) int32, rows of vertices
    colours : (V, 3) uint8, red, green, blue
    n_points : that the surface was fitted to
    spacing : m, of these points
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    colours: NDArray[np.uint8]
    n_points: int
    spacing: float

    @property
    def area(self) -> float:
        """Of all triangles, m²."""
        a, b, c = np.moveaxis(self.vertices[self.triangles], 1, 0)
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)

    def sentence(self) -> str:
        """Say what there is."""
        return (
            f"{len(self.triangles):,} triangles, {self.area:,.1f} m², fitted to "
            f"{self.n_points:,} points {100 * self.spacing:g} cm apart"
        )


def mesh_of(
    run: Path | str,
    *,
    spacing: float = SPACING,
    colour: MeshColour = "height",
    progress: Progress | None = None,
) -> Mesh:
    """Fit a surface to the map of a finished run, as triangles.

    Parameters
    ----------
    run : folder that `map`, `merge` or `localize` has written
    spacing : m, edge of the voxels of which each gives one point, and about that of the triangles; see
        `oriented_points`
    colour : what the vertices show, `height` or `intensity`

    Returns
    -------
    In the coordinates of the map's file.

    Raises
    ------
    UsageError
        If Open3D is not installed, the folder holds no complete run, or a value cannot be used.
    InputError
        If there is no map, nothing says from where its points were seen, or they have no intensity.

    References
    ----------
    Kazhdan, Hoppe 2013, Screened Poisson surface reconstruction.
    """
    source = open_map_of(run)
    found = _fit(source, spacing, colour, progress or Progress())
    return replace(found, vertices=found.vertices + source.origin)


def write_mesh(
    run: Path | str,
    out: Path | str,
    *,
    spacing: float = SPACING,
    colour: MeshColour = "height",
    progress: Progress | None = None,
) -> Mesh:
    """Fit a surface to the map of a finished run, and write it.

    Parameters
    ----------
    run, spacing, colour : see `mesh_of`
    out : file to write, .ply, .obj or .glb; as glTF demands, the second axis of .glb points upwards, and
        coordinates are in single precision, relative to `origin` of the node's `extras`

    Raises
    ------
    UsageError, InputError
        As `mesh_of`; also where the file cannot be written.
    """
    source, path, progress = open_map_of(run), Path(out), progress or Progress()
    require_new(path, MESH_SUFFIXES)
    local = _fit(source, spacing, colour, progress)
    with progress.stage("writing"):
        write_triangles(path, local.vertices, local.triangles, local.colours, source.origin)
    return replace(local, vertices=local.vertices + source.origin)


def _fit(source: FinishedMap, spacing: float, colour: MeshColour, progress: Progress) -> Mesh:
    if colour not in get_args(MeshColour):
        msg = f"--colour {colour} cannot be used; give height or intensity"
        raise UsageError(msg)
    require_open3d()
    cloud = orient(source, spacing, progress)
    if colour == "intensity" and cloud.intensity is None:
        msg = f"{source.path}: its points have no intensity; colour the mesh by height"
        raise InputError(msg)
    with progress.stage("fitting the surface"):
        vertices, triangles = fit_surface(cloud)
    if not len(triangles):
        msg = f"{source.path}: its {len(cloud.points)} points {cloud.spacing:g} m apart make no surface; give a smaller --spacing"
        raise InputError(msg)
    colours = _colours(vertices, cloud if colour == "intensity" else None)
    return Mesh(vertices, triangles, colours, len(cloud.points), cloud.spacing)


def fit_surface(cloud: OrientedPoints) -> tuple[Array, NDArray[np.int32]]:
    """Return vertices (V, 3) m and triangles (T, 3) of the surface, where there are points.

    The surface is closed by nature: where there are no points it is invented, and left out here.
    """
    o3d = require_open3d()
    edge = _MARGIN * float(np.ptp(cloud.points, axis=0).max())
    depth = int(np.clip(np.ceil(np.log2(max(edge / cloud.spacing, 1.0))), 1, _DEEPEST))
    given = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points))
    given.normals = o3d.utility.Vector3dVector(cloud.normals)
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        # With one thread sums have one order, so that the result is the same each time.
        mesh, densities = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(
            given, depth=depth, scale=_MARGIN, n_threads=1
        )
    density = np.asarray(densities)
    if len(density):
        mesh.remove_vertices_by_mask(density < np.median(density) - _SPARSER)
    return np.array(mesh.vertices), np.array(mesh.triangles, np.int32)


def _colours(vertices: Array, cloud: OrientedPoints | None) -> NDArray[np.uint8]:
    """Return colours (V, 3) of the heights, or of the intensity of a cloud."""
    if cloud is None or cloud.intensity is None:
        values = vertices[:, 2]
    else:
        n = min(_BLENDED, len(cloud.points))
        near = cKDTree(cloud.points).query(vertices, np.arange(1, n + 1))[1]
        values = cloud.intensity[near].mean(axis=1)
    low, high = np.percentile(values, _ENDS)
    shares = (values - low) / max(high - low, 1e-9)
    return np.rint(colour_of(shares, HEIGHT)).astype(np.uint8)
