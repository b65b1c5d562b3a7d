# SPDX-License-Identifier: MIT OR Apache-2.0
"""A map coloured by its distance from the reference: a drawing, and a cloud for other programs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.atomic import atomic_path
from bentwing.base.voxels import column_keys, voxel_keys
from bentwing.report.colours import ERROR, colour
from bentwing.report.picture import paint, project
from bentwing.report.svg import map_view

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.evaluate.against_surface import MapError

_CM = 100.0
_REACH = 3.0  # standard deviations at the ends of the colour map
_CELL = 0.05  # m, edge of the voxels whose points share their mean
_HEADROOM = 0.3  # m above the sensor from which on a point counts as overhead
_COLUMN = 1.0  # m, edge of the columns in which a roof is looked for
_ROOFED_SHARE = 0.5  # of the places of the sensor


def draw_error_map(error: MapError) -> str:
    """Plan of the map, blue in front of the reference and red behind it.

    Every voxel has the mean of its points: of single ones only those in front would be seen.

    References
    ----------
    Kaul 2015, figure 21d.
    """
    seen = ~_overhead(error)
    points, distances = error.points[seen], _averaged(error.points[seen], error.distances[seen])
    reach = max(round(_REACH * _CM * error.robust_std, 1), 0.1)
    projection = project(*points.T, width=1000, max_height=800)
    view = paint(projection, _CM * distances, table=ERROR, shading=0.6, span=(-reach, reach))
    return map_view(view, "error, cm", ERROR, name="Map by distance from the reference")


def write_error_cloud(path: Path, error: MapError) -> None:
    """Write the measured points in the reference's frame with `error` in m and colours, as PLY."""
    kinds = [(axis, "<f8") for axis in "xyz"] + [("error", "<f4")]
    names = ("red", "green", "blue")
    rows = np.empty(len(error.points), np.dtype(kinds + [(name, "u1") for name in names]))
    points = error.points + error.origin
    reach = _REACH * max(error.robust_std, 1e-9)
    shades = colour(0.5 + 0.5 * error.distances / reach, ERROR)
    for i, axis in enumerate("xyz"):
        rows[axis], rows[names[i]] = points[:, i], shades[:, i]
    rows["error"] = error.distances
    properties = [f"property double {axis}" for axis in "xyz"] + ["property float error"]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        "comment error in metres along the normals of the reference, positive behind",
        f"element vertex {len(rows)}",
        *properties,
        *(f"property uchar {name}" for name in names),
        "end_header",
        "",
    ]
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write("\n".join(header).encode("ascii"))
        rows.tofile(file)


def _averaged(points: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give every point the mean value of its voxel."""
    # floors often lie at round heights: these are in the middle of a voxel, not on its face
    _, voxel = np.unique(voxel_keys(points + _CELL / 2, _CELL), return_inverse=True)
    mean: NDArray[np.float64] = np.bincount(voxel, values) / np.bincount(voxel)
    return mean[voxel]


def _overhead(error: MapError) -> NDArray[np.bool_]:
    """Points above the sensor, if it was below a roof; they would hide everything from above."""
    none = np.zeros(len(error.points), np.bool_)
    if error.front != "sensor":
        return none
    above: NDArray[np.bool_] = (
        error.points[:, 2] > np.percentile(error.viewpoints[:, 2], 95) + _HEADROOM
    )
    roofed = np.isin(
        column_keys(error.viewpoints, _COLUMN), column_keys(error.points[above], _COLUMN)
    )
    return above if roofed.mean() > _ROOFED_SHARE else none
