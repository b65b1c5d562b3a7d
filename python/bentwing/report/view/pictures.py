# SPDX-License-Identifier: MIT OR Apache-2.0
"""Still pictures of a run: plan, sections and views as PNG, the plan as GeoTIFF where it has a place."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import InputError
from bentwing.base.run_record import finished_record
from bentwing.base.trajectory import Trajectory
from bentwing.map.epsg import epsg_of_map
from bentwing.map.gps_time import adjusted_gps_origin
from bentwing.map.read import read_parts
from bentwing.report.colours import TIME
from bentwing.report.finished import map_of, trajectory_of
from bentwing.report.geotiff import write_geotiff
from bentwing.report.lettering import with_scale
from bentwing.report.picture import View, paint, project, write_png
from bentwing.report.view.levels import FINEST, Level
from bentwing.report.views import SLAB, overhead_points

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.progress import Progress

WIDTH, HEIGHT = 2400, 1800  # pixels at most
_MOST = 5_000_000  # points
_APART = 100.0  # m beyond the map at which a trajectory is in another frame


@dataclass(frozen=True, slots=True)
class Pictured:
    """A run as pictures need it, relative to a place nearby.

    Attributes
    ----------
    points, times : (N, 3) m and (N,) s, of the map, spread evenly; times do not decrease
    trajectory : of the IMU in the same frame; empty where it is in another
    origin : (3,) m, of the points in the map's frame
    epsg : of the map's coordinates, None where they are local
    """

    points: NDArray[np.float64]
    times: NDArray[np.float64]
    trajectory: Trajectory
    origin: NDArray[np.float64]
    epsg: int | None


def read_pictured(run: Path, most: int = _MOST) -> Pictured:
    """Read a run folder.

    Raises
    ------
    UsageError
        If it is no run folder, or the run is not complete.
    InputError
        If it has no map, or its map or trajectory cannot be read.
    """
    record = finished_record(run)
    path = map_of(run)
    if path is None:
        msg = (
            f"{run}: the run has no map; run `bentwing map` again, to its end and without --no-map"
        )
        raise InputError(msg)
    trajectory, origin_ns = trajectory_of(run / "trajectory.txt", record)
    begin = adjusted_gps_origin(origin_ns) if path.suffix in {".laz", ".las"} else 0.0
    level = Level(FINEST, most)
    origin: NDArray[np.float64] | None = None
    for part in read_parts(path):
        if origin is None:  # geographic coordinates are too large for single precision
            origin = np.round(np.median(part.points, axis=0))
        times = np.zeros(len(part.points)) if part.times is None else part.times - begin
        level.add(part.points - origin, times)
    points = level.result.points.astype(np.float64)
    if origin is None or not len(points):
        msg = f"{path}: holds no point; give a run with a map"
        raise InputError(msg)
    local = replace(trajectory, positions=trajectory.positions - origin)
    if _elsewhere(local.positions, points):
        local = Trajectory(np.empty(0), np.empty((0, 3)), np.empty((0, 4)))
    order = np.argsort(level.result.times, kind="stable")
    return Pictured(points[order], level.result.times[order], local, origin, epsg_of_map(path))


def write_pictures(run: Path, out: Path, progress: Progress) -> list[Path]:
    """Write top.png, top_time.png, section_along.png and section_across.png, and top.tif if georeferenced.

    All are orthographic, in ambient and eye-dome light, with a scale bar. Sections are cut
    through the middle of the way, `SLAB` thick.
    """
    with progress.stage("reading the map"):
        what = read_pictured(run)
    out.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []

    def keep(name: str, view: View, up: str) -> None:
        write_png(out / name, with_scale(view, up))
        written.append(out / name)

    with progress.stage("drawing"):
        seen = ~overhead_points(what.points, what.times, what.trajectory)
        x, y, z = what.points[seen].T
        top = project(x, y, z, width=WIDTH, max_height=HEIGHT)
        up = "y" if what.epsg is None else "N"
        by_height = paint(top, z)
        keep("top.png", by_height, up)
        keep("top_time.png", paint(top, what.times[seen], table=TIME, shading=0.5), up)
        for name, axis in (("section_along", 0), ("section_across", 1)):
            keep(f"{name}.png", section(what, axis), "z")
        if what.epsg is not None:
            placed = replace(
                by_height, left=by_height.left + what.origin[0], top=by_height.top + what.origin[1]
            )
            write_geotiff(out / "top.tif", placed, what.epsg)
            written.append(out / "top.tif")
    return written


def section(what: Pictured, axis: int) -> View:
    """Cut the map upright along its x or y axis, through the middle of the way."""
    path = what.trajectory.positions
    centre = np.median(path if len(path) else what.points, axis=0)
    slab = np.abs(what.points[:, 1 - axis] - centre[1 - axis]) < SLAB / 2
    x, y, z = what.points[slab].T
    across, toward = (x, -y) if axis == 0 else (-y, -x)
    # gaps stay, because closing them would make walls look thicker than they are
    return paint(project(across, z, toward, width=WIDTH, max_height=HEIGHT, close_gaps=0), z)


def _elsewhere(path: NDArray[np.float64], points: NDArray[np.float64]) -> bool:
    if not len(path):
        return False
    low, high = points.min(axis=0) - _APART, points.max(axis=0) + _APART
    middle = np.median(path, axis=0)
    return bool(((middle < low) | (middle > high)).any())
