# SPDX-License-Identifier: MIT OR Apache-2.0
"""Occupancy grids for the planners of ROS: where something is, and where beams have passed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import uniform_filter

from bentwing.base.atomic import write_bytes, write_text
from bentwing.base.errors import UsageError
from bentwing.base.new_file import require_new
from bentwing.base.progress import Progress
from bentwing.base.value import Value
from bentwing.products.beams import Passages
from bentwing.products.cutting import cut_map
from bentwing.products.finished_map import open_map_of
from bentwing.report.picture import extent

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.products.finished_map import FinishedMap
    from bentwing.products.plane import CutPlane

OCCUPIED, FREE, UNKNOWN = 100, 0, -1
_FEWEST = 3  # points in and around a cell that make it occupied
_MARGIN = 0.5  # m around the points
_MOST = 100_000_000  # cells
# What map_server of ROS 1 and Nav2 both read as occupied, free and unknown, by these thresholds.
_GREY = {OCCUPIED: 0, FREE: 254, UNKNOWN: 205}
_YAML = """\
image: {image}
mode: trinary
resolution: {cell:.10g}
origin: [{x:.10g}, {y:.10g}, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid(Value):
    """What is known of the cells of a level slab.

    Attributes
    ----------
    cells : (H, W) int8, `nav_msgs/OccupancyGrid`: 100 occupied, 0 free, -1 unknown; lowest y first
    cell : m, edge of a cell
    origin : (2,) m, lower left corner of the grid in the coordinates of the map
    """

    cells: NDArray[np.int8]
    cell: float
    origin: NDArray[np.float64]

    def sentence(self) -> str:
        """Say what there is."""
        area = self.cell**2 * np.array(
            [np.count_nonzero(self.cells == v) for v in (FREE, OCCUPIED)]
        )
        height, width = self.cells.shape
        if not area[0]:
            return (
                f"{width} x {height} cells, {area[1]:.1f} m² occupied, none known to be free: the map "
                "has no trajectory or no times, or its runs were recorded at the same time, so that "
                "nobody knows where the beams passed"
            )
        return f"{width} x {height} cells, {area[0]:.1f} m² free, {area[1]:.1f} m² occupied"


def write_occupancy(
    run: Path | str,
    out: Path | str,
    plane: CutPlane | float = 1.0,
    *,
    thickness: float = 1.0,
    cell: float = 0.05,
    progress: Progress | None = None,
) -> OccupancyGrid:
    """Write an occupancy grid of a finished run: a YAML file, and a PGM picture beside it.

    Parameters
    ----------
    run : folder that `map`, `merge` or `localize` has written
    out : file to write, .yaml
    plane : a level one in the coordinates of the map, or its height, m, above the floor
    thickness : m, of the slab whose points are obstacles
    cell : m, edge of a cell

    Raises
    ------
    UsageError, InputError
        As `section_of`; also where the plane is not level or the grid would be too large.
    """
    source, path = open_map_of(run), Path(out)
    require_new(path, (".yaml",))
    require_new(path.with_suffix(".pgm"), (".pgm",))
    grid = _grid_of(source, plane, thickness, cell, progress or Progress())
    grey: NDArray[np.uint8] = np.zeros(grid.cells.shape, np.uint8)
    for value, shade in _GREY.items():
        grey[grid.cells == value] = shade
    size = f"{grey.shape[1]} {grey.shape[0]}"
    write_bytes(path.with_suffix(".pgm"), f"P5\n{size}\n255\n".encode() + grey[::-1].tobytes())
    x, y = grid.origin.tolist()
    image = path.with_suffix(".pgm").name
    write_text(path, _YAML.format(image=image, cell=grid.cell, x=x, y=y))
    return grid


def occupancy_of(
    run: Path | str,
    plane: CutPlane | float = 1.0,
    *,
    thickness: float = 1.0,
    cell: float = 0.05,
    progress: Progress | None = None,
) -> OccupancyGrid:
    """Return what `write_occupancy` writes."""
    return _grid_of(open_map_of(run), plane, thickness, cell, progress or Progress())


def _grid_of(
    source: FinishedMap,
    plane: CutPlane | float,
    thickness: float,
    cell: float,
    progress: Progress,
) -> OccupancyGrid:
    if not 0 < cell < np.inf:
        msg = f"--cell {cell} cannot be used; give a length in metres above 0"
        raise UsageError(msg)
    found = cut_map(source, plane, thickness, progress)
    if not found.plane.is_level:
        msg = "an occupancy grid needs a level cut; give --plan or --level instead of --plane"
        raise UsageError(msg)
    places = found.slab.places
    ends = np.array([extent(axis) for axis in places.T])
    low, high = ends[:, 0], ends[:, 1]
    corner = np.floor((low - _MARGIN) / cell) * cell
    size = np.ceil((high + _MARGIN - corner) / cell)
    width, height = int(size[0]), int(size[1])
    if width * height > _MOST:
        msg = f"--cell {cell}: the grid would have {width} x {height} cells; give a larger cell"
        raise UsageError(msg)
    passages = Passages(corner, (height, width), cell)
    level = float(found.plane.origin[2])
    with progress.stage("following the beams"):
        for part in source.parts():
            if part.times is not None:
                sensors = source.sensors_at(part.times)
                passages.add(sensors, part.points, (level - thickness / 2, level + thickness / 2))
    hits = passages.counted(places, found.slab.counts)
    # A table has few points in a cell, and beams pass above and below it; a stray point is alone.
    around = uniform_filter(hits.astype(np.float64), 3, mode="constant") * 9.0
    occupied = (hits > 0) & (around > _FEWEST - 0.5)
    cells = np.full(hits.shape, UNKNOWN, np.int8)
    cells[passages.counts > 0] = FREE
    cells[occupied] = OCCUPIED
    return OccupancyGrid(cells, cell, corner + source.origin[:2])
