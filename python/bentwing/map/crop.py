# SPDX-License-Identifier: MIT OR Apache-2.0
"""Parts of a map: a box, an area, heights, times, and what is near a path."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.arguments import finite_array
from bentwing.base.search_tree import nearest
from bentwing.base.value import Value
from bentwing.base.voxels import by_key, cells_of, centres_of, pack
from bentwing.map.polygon import Polygon, contained

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable

    from numpy.typing import NDArray

    from bentwing.map.chunk import MapChunk

    Array = NDArray[np.float64]
    Span = tuple[float, float]

_CELL = 0.05  # of the distance
_PATH_STEP = 0.005  # of the distance: a path that is thinned so is 1e-5 of it too far at most


@dataclass(frozen=True, eq=False)
class Crop(Value):
    """What is kept of a map: points that are inside of all that is given; all points without anything.

    Coordinates are those of the map as it is written. Borders belong to a box, to heights and to times.

    Attributes
    ----------
    box : x0, y0, z0, x1, y1, z1, m; None for no box
    area : polygons seen from above, any of which a point is in, at any height
    heights : lowest and highest z, m
    times : first and last, s since the start of the recording (of the first, in a map of several)
    within : m, largest distance from the path of the IMU

    Raises
    ------
    ValueError, TypeError
        If a number is not finite, or an upper limit is below its lower one.
    """

    box: tuple[float, float, float, float, float, float] | None = None
    area: tuple[Polygon, ...] | Polygon | None = None
    heights: Span | None = None
    times: Span | None = None
    within: float | None = None

    def __post_init__(self) -> None:
        for name, n in (("box", 6), ("heights", 2), ("times", 2)):
            value = getattr(self, name)
            if value is None:
                continue
            limits = finite_array(name, value, n)
            low, high = limits[: n // 2], limits[n // 2 :]
            if (low > high).any():
                msg = f"{name}: expected the lower limits first, got {limits.tolist()}"
                raise ValueError(msg)
            object.__setattr__(self, name, tuple(limits.tolist()))
        if isinstance(self.area, Polygon):
            object.__setattr__(self, "area", (self.area,))
        if self.area == ():
            msg = "area: expected a polygon or more, got none"
            raise ValueError(msg)
        if self.within is not None and not (np.isfinite(self.within) and self.within > 0):
            msg = f"within: expected a distance above 0 m, got {self.within}"
            raise ValueError(msg)

    def __bool__(self) -> bool:
        return any(getattr(self, f.name) is not None for f in fields(self))

    @property
    def polygons(self) -> tuple[Polygon, ...]:
        """The areas; none where there is no limit."""
        return (self.area,) if isinstance(self.area, Polygon) else self.area or ()

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest corner (3,) m of where points can be; infinite where nothing says."""
        low, high = np.full(3, -np.inf), np.full(3, np.inf)
        if self.box is not None:
            low, high = np.array(self.box[:3]), np.array(self.box[3:])
        if self.polygons:
            low[:2] = np.maximum(low[:2], np.min([p.low for p in self.polygons], axis=0))
            high[:2] = np.minimum(high[:2], np.max([p.high for p in self.polygons], axis=0))
        if self.heights is not None:
            low[2], high[2] = max(low[2], self.heights[0]), min(high[2], self.heights[1])
        return low, high


@dataclass(frozen=True, eq=False)
class Cropper:
    """A crop of the map of one run.

    Attributes
    ----------
    crop : what is kept
    path : (M, 3) m, of the IMU; needed for `crop.within`
    to_path : takes points (N, 3) to the frame of the path
    """

    crop: Crop
    path: Array = field(default_factory=lambda: np.empty((0, 3)))
    to_path: Callable[[Array], Array] = np.asarray

    def chunks(
        self, chunks: Iterable[MapChunk], counts: dict[str, int] | None = None
    ) -> Generator[MapChunk, None, None]:
        """Keep what is inside.

        Parameters
        ----------
        counts : receives `map.cropped`, the points left out
        """
        counts = {} if counts is None else counts
        counts.setdefault("map.cropped", 0)
        for chunk in chunks:
            keep = self.keep(chunk.points, chunk.times)
            kept = chunk if keep.all() else chunk.where(keep)
            counts["map.cropped"] += len(chunk) - len(kept)
            if len(kept):
                yield kept

    def keep(self, points: Array, times: Array) -> NDArray[np.bool_]:
        """Whether each of points (N, 3) m, of times (N,) s, is inside.

        The costly questions are asked of those points only that the others have left.
        """
        crop, (low, high) = self.crop, self.crop.bounds
        keep = np.ones(len(points), np.bool_)
        for axis in range(3):
            if np.isfinite(low[axis]) or np.isfinite(high[axis]):
                keep &= (points[:, axis] >= low[axis]) & (points[:, axis] <= high[axis])
        if crop.times is not None:
            keep &= (times >= crop.times[0]) & (times <= crop.times[1])
        if crop.polygons:
            left = np.flatnonzero(keep)
            keep[left] = contained(crop.polygons, points[left, :2])
        if crop.within is not None:
            left = np.flatnonzero(keep)
            keep[left] = self._is_near(self.to_path(points[left]), crop.within)
        return keep

    def _is_near(self, points: Array, limit: float) -> NDArray[np.bool_]:
        """Whether each of points (N, 3) is within a limit of the path.

        Cells say it of most points at once: those whose centre is so near, or so far, that all of a cell is.
        """
        edge = limit * _CELL
        cells = cells_of(points, edge)
        order, starts = by_key(pack(cells))
        distances = self._distances(centres_of(cells[order[starts]], edge), 2 * limit)
        lengths = np.diff(np.append(starts, len(order)))
        of_points = np.empty(len(points))
        of_points[order] = np.repeat(distances, lengths)
        margin = 0.5 * np.sqrt(3.0) * edge * (1.0 + 1e-9)
        near: NDArray[np.bool_] = of_points <= limit - margin
        unsure = np.flatnonzero(~near & (of_points <= limit + margin))
        near[unsure] = self._distances(points[unsure], 2 * limit) <= limit
        return near

    def _distances(self, points: Array, limit: float) -> Array:
        return nearest(self._tree, points, [1], limit)[0][:, 0]

    @cached_property
    def _tree(self):  # type: ignore[no-untyped-def] # noqa: ANN202 - scipy has no types
        from scipy.spatial import cKDTree

        return cKDTree(_thinned(self.path, (self.crop.within or 0.0) * _PATH_STEP))


def _thinned(path: Array, step: float) -> Array:
    """Return poses of a path (M, 3) of which no two neighbours are much nearer than a step."""
    if len(path) < 2:
        return path
    lengths = np.linalg.norm(np.diff(path, axis=0), axis=1)
    passed = np.floor(np.append(0.0, np.cumsum(lengths)) / max(step, 1e-9))
    thinned: Array = path[np.append(True, np.diff(passed) > 0)]
    return thinned
