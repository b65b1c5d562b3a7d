# SPDX-License-Identifier: MIT OR Apache-2.0
"""Still pictures of a run: plan, sections and views as PNG, the plan as GeoTIFF where it has a place."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from bentwing.base.errors import InputError
from bentwing.base.new_file import require_folder
from bentwing.base.trajectory import Trajectory
from bentwing.map.epsg import epsg_of_map
from bentwing.report.colours import HEIGHT as HEIGHTS
from bentwing.report.colours import TIME
from bentwing.report.finished import ShownRun
from bentwing.report.frame import ShownFrame
from bentwing.report.geotiff import write_geotiff
from bentwing.report.lettering import Lettering, lettered
from bentwing.report.picture import Projection, View, frame_of, paint, project, write_png
from bentwing.report.view.levels import FINEST, Level
from bentwing.report.views import SLAB, overhead_points

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.progress import Progress

WIDTH, HEIGHT = 2400, 1800  # pixels at most
_MOST = 5_000_000  # points
_FINEST = 0.001  # m, edge of a pixel at least
_ROUND = [m * 10.0**e for e in range(-3, 5) for m in (1, 2, 5)]  # m, edges of a pixel
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
    finished = ShownRun.open(run)
    path = finished.run.require_map()
    frame = ShownFrame.of(finished.run.record.get("georeference"))
    level = Level(FINEST, most)
    origin = frame.origin if frame.origin.any() else None
    for places, times in finished.parts():
        shown = frame.points(places)
        if origin is None:  # coordinates may be too large for single precision
            origin = np.round(np.median(shown, axis=0))
            frame = replace(frame, place=frame.place - origin)
            shown = shown - origin
        level.add(shown, times)
    points = level.result.points.astype(np.float64)
    if origin is None or not len(points):
        msg = f"{path}: holds no point; give a run with a map"
        raise InputError(msg)
    local = frame.trajectory(finished.trajectory)
    if _elsewhere(local.positions, points):
        local = Trajectory(np.empty(0), np.empty((0, 3)), np.empty((0, 4)))
    order = np.argsort(level.result.times, kind="stable")
    epsg = epsg_of_map(path)
    return Pictured(points[order], level.result.times[order], local, origin, epsg)


def write_pictures(run: Path, out: Path, progress: Progress) -> list[Path]:
    """Write top.png, top_time.png, section_along.png and section_across.png, and top.tif if georeferenced.

    All are orthographic, in ambient and eye-dome light, with title, grid, scale bar and legend; a pixel
    is a round length. Sections are cut through the middle of the way, `SLAB` thick.
    """
    require_folder(out)
    with progress.stage("reading the map"):
        what = read_pictured(run)
    out.mkdir(parents=True, exist_ok=True)
    with progress.stage("drawing"):
        name, top = run.resolve().name.upper(), _plans(what)
        drawn = {**top, **_sections(what)}
        for file, (view, words) in drawn.items():
            write_png(out / file, lettered(view, replace(words, title=f"{name}: {words.title}")))
        written = [out / file for file in drawn]
        if what.epsg is not None:
            view, _ = top["top.png"]
            placed = replace(view, left=view.left + what.origin[0], top=view.top + what.origin[1])
            write_geotiff(out / "top.tif", placed, what.epsg)
            written.append(out / "top.tif")
    return written


Drawings: TypeAlias = "dict[str, tuple[View, Lettering]]"


def _plans(what: Pictured) -> Drawings:
    """Draw the map from above, without what is above the sensor under a roof."""
    seen = ~overhead_points(what.points, what.times, what.trajectory)
    x, y, z = what.points[seen].T
    top = round_projection(x, y, z)
    up, place = "y" if what.epsg is None else "N", (float(what.origin[0]), float(what.origin[1]))
    by_time = paint(top, what.times[seen], table=TIME, shading=0.5)
    return {
        "top.png": (
            _raised(paint(top, z), what),
            Lettering("PLAN, HEIGHT", up, "m", HEIGHTS, place),
        ),
        "top_time.png": (by_time, Lettering("PLAN, TIME", up, "s", TIME, place)),
    }


def _sections(what: Pictured) -> Drawings:
    drawings = {}
    for file, axis, name in (("section_along", 0, "x"), ("section_across", 1, "y")):
        title = f"SECTION {SLAB:g} m THICK, {name} TO THE RIGHT"
        place = float(what.origin[axis]), float(what.origin[2])
        words = Lettering(title, "z", "m", HEIGHTS, place)
        drawings[f"{file}.png"] = _raised(section(what, axis), what), words
    return drawings


def _raised(view: View, what: Pictured) -> View:
    """Give the ends of the legend the heights that the map has."""
    up = float(what.origin[2])
    return replace(view, low=view.low + up, high=view.high + up)


def round_projection(
    across: NDArray[np.float64],
    up: NDArray[np.float64],
    toward: NDArray[np.float64],
    close_gaps: int = 3,
) -> Projection:
    """Project points so that a pixel is a round length, and its edges lie at multiples of it."""
    left, right, bottom, top = frame_of(across, up)
    least = max((right - left) / WIDTH, (top - bottom) / HEIGHT, _FINEST)
    pixel = next(p for p in _ROUND if p >= least * 0.999)
    left, bottom = pixel * np.floor(left / pixel), pixel * np.floor(bottom / pixel)
    columns, rows = int(np.ceil((right - left) / pixel)), int(np.ceil((top - bottom) / pixel))
    frame = (left, left + columns * pixel, bottom, bottom + rows * pixel)
    return project(
        across, up, toward, width=columns, max_height=rows, close_gaps=close_gaps, frame=frame
    )


def section(what: Pictured, axis: int) -> View:
    """Cut the map upright along its x or y axis, through the middle of the way."""
    path = what.trajectory.positions
    centre = np.median(path if len(path) else what.points, axis=0)
    slab = np.abs(what.points[:, 1 - axis] - centre[1 - axis]) < SLAB / 2
    x, y, z = what.points[slab].T
    across, toward = (x, -y) if axis == 0 else (y, x)
    # gaps stay, because closing them would make walls look thicker than they are
    return paint(round_projection(across, z, toward, close_gaps=0), z)


def _elsewhere(path: NDArray[np.float64], points: NDArray[np.float64]) -> bool:
    if not len(path):
        return False
    low, high = points.min(axis=0) - _APART, points.max(axis=0) + _APART
    middle = np.median(path, axis=0)
    return bool(((middle < low) | (middle > high)).any())
