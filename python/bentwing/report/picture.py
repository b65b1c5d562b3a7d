# SPDX-License-Identifier: MIT OR Apache-2.0
"""Pictures of a point cloud without any drawing library: project, shade, encode as PNG."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from bentwing.base.atomic import write_bytes
from bentwing.report.colours import HEIGHT, colour
from bentwing.report.occlusion import ambient

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

_Scalar = TypeVar("_Scalar", bound=np.generic)

PAPER = 255  # brightness where there is no point
_ENCLOSED = 3  # filled neighbours of eight
_DARKEST = np.float32(0.3)  # of ambient light that is left where none comes in
_RADII = (1, 3)  # pixels over which depth is compared
_OUTLIERS = 0.1  # percent of the points on each side that may fall off the picture
_SLACK = 0.25  # of the extent without outliers that they may add on each side
_FINEST = 1e-4  # m, edge of a pixel at least
_EFFORT = 1  # of zlib; higher levels take twice the time and save no hundredth of the size
_THINNED = 100_000  # points that are enough for a percentile
_NEIGHBOURS = ((0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1))


@dataclass(frozen=True, slots=True)
class View:
    """An orthographic picture.

    Attributes
    ----------
    image : (H, W, 3) uint8, first row on top
    pixel : m, edge of a pixel
    left, top : m, coordinates of the upper left corner along the picture's axes
    low, high : values at the two ends of the colour map
    """

    image: NDArray[np.uint8]
    pixel: float
    left: float
    top: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Projection:
    """What is seen of a cloud along one direction, before it is coloured.

    Attributes
    ----------
    front : (H, W) intp, index of the point nearest to the viewer, -1 where there is none
    light : (H, W) float32, brightness, see `_eye_dome` and `ambient`
    pixel, left, top : as of a `View`
    """

    front: NDArray[np.intp]
    light: NDArray[np.float32]
    pixel: float
    left: float
    top: float


def render(
    across: NDArray[np.float64],
    up: NDArray[np.float64],
    toward: NDArray[np.float64],
    values: NDArray[np.float64],
    *,
    width: int = 1100,
    max_height: int = 900,
    table: tuple[str, ...] = HEIGHT,
    shading: float = 1.0,
    close_gaps: int = 3,
) -> View:
    """Draw points as seen from far away along one direction; see `project` and `paint`."""
    seen = project(across, up, toward, width=width, max_height=max_height, close_gaps=close_gaps)
    return paint(seen, values, table=table, shading=shading)


def project(
    across: NDArray[np.float64],
    up: NDArray[np.float64],
    toward: NDArray[np.float64],
    *,
    width: int = 1100,
    max_height: int = 900,
    close_gaps: int = 3,
    frame: tuple[float, float, float, float] | None = None,
) -> Projection:
    """Find what is seen of points from far away along one direction.

    Parameters
    ----------
    across, up, toward : (N,) m, coordinates to the right, upwards and to the viewer
    width, max_height : pixels; the picture gets smaller pixels only as far as both allow
    close_gaps : pixels by which gaps are filled from their edges; it thickens lines as well
    frame : left, right, bottom and top of the picture, m; default: what holds all but far outliers
    """
    left, right, bottom, top = frame or frame_of(across, up)
    pixel = max((right - left) / width, (top - bottom) / max_height, _FINEST)
    shape = (max(int((top - bottom) / pixel), 1) + 1, max(int((right - left) / pixel), 1) + 1)
    front = _front_points(((top - up) / pixel, (across - left) / pixel), toward, shape)
    depth = np.full(shape, -np.inf, np.float32)
    seen = front >= 0
    nearest = toward[front[seen]]
    # single precision is far below a pixel once the depths are relative to each other
    depth[seen] = (nearest - nearest[:1]) / pixel
    for _ in range(close_gaps):
        _close_gaps(depth, front)
    return Projection(
        front, _eye_dome(depth) * (_DARKEST + (1 - _DARKEST) * ambient(depth)), pixel, left, top
    )


def paint(
    seen: Projection,
    values: NDArray[np.float64],
    *,
    table: tuple[str, ...] = HEIGHT,
    shading: float = 1.0,
    span: tuple[float, float] | None = None,
) -> View:
    """Colour what is seen.

    Parameters
    ----------
    seen : the projection of N points
    values : (N,) what the colour shows
    table : colour map
    shading : 0 for flat colours, 1 for full eye-dome lighting and ambient occlusion
    span : values at the ends of the colour map; default: of the central 98 %
    """
    if span is None:
        span = tuple(np.percentile(thinned(values), [1, 99])) if len(values) else (0.0, 1.0)
    low, high = span
    filled = np.flatnonzero(seen.front >= 0)
    shade = (values[seen.front.ravel()[filled]] - low) / max(high - low, 1e-9)
    light = 1 - shading * (1 - seen.light.ravel()[filled])
    image = np.full((seen.front.size, 3), PAPER, np.uint8)
    image[filled] = colour(shade, table) * light[:, None]
    image = image.reshape(*seen.front.shape, 3)
    return View(image, seen.pixel, seen.left, seen.top, float(low), float(high))


def render_top(
    points: NDArray[np.float64],
    values: NDArray[np.float64] | None = None,
    *,
    width: int = 1100,
    max_height: int = 900,
    table: tuple[str, ...] = HEIGHT,
) -> NDArray[np.uint8]:
    """Picture of a map from above, x to the right and y up.

    Parameters
    ----------
    points : (N, 3) float64, m, map frame
    values : (N,) what the colour shows; default: the height
    width, max_height : pixels
    table : colour map

    Returns
    -------
    (H, W, 3) uint8
    """
    x, y, z = points.T
    shown = z if values is None else values
    return render(x, y, z, shown, width=width, max_height=max_height, table=table).image


def encode_png(image: NDArray[np.uint8]) -> bytes:
    """Encode an `(H, W, 3)` uint8 picture as PNG."""
    height, width, _ = image.shape
    # filter "up": differences to the row above compress far better than the colours themselves
    above = np.vstack([np.zeros_like(image[:1]), image[:-1]])
    rows = np.empty((height, 1 + 3 * width), np.uint8)
    rows[:, 0] = 2
    rows[:, 1:] = (image - above).reshape(height, -1)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.data, _EFFORT)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_png_chunk(kind, data) for kind, data in chunks)


def write_png(path: Path, image: NDArray[np.uint8]) -> None:
    """Write an `(H, W, 3)` uint8 picture as a PNG file, atomically."""
    write_bytes(path, encode_png(image))


def _png_chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def frame_of(
    across: NDArray[np.float64], up: NDArray[np.float64]
) -> tuple[float, float, float, float]:
    """Left, right, bottom and top that hold all but far outliers, with a margin of 2 %."""
    if not len(across):
        return -1.0, 1.0, -1.0, 1.0
    left, right = extent(across)
    bottom, top = extent(up)
    margin = 0.02 * max(right - left, top - bottom, 1.0)
    return left - margin, right + margin, bottom - margin, top + margin


def extent(values: NDArray[np.float64]) -> tuple[float, float]:
    """Return the ends of values (N,) without far outliers."""
    low, high = np.percentile(thinned(values), [_OUTLIERS, 100 - _OUTLIERS])
    # a far wall has few points, but is not far outside of the rest
    slack = _SLACK * (high - low)
    return float(max(low - slack, values.min())), float(min(high + slack, values.max()))


def thinned(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Every k-th of values `(N, ...)`, k odd so as not to keep step with the beams of a lidar."""
    return values[:: len(values) // _THINNED | 1]


def _front_points(
    place: tuple[NDArray[np.float64], NDArray[np.float64]],
    toward: NDArray[np.float64],
    shape: tuple[int, int],
) -> NDArray[np.intp]:
    """Index of the point nearest to the viewer in every pixel, -1 where there is none."""
    row, column = place
    outside = shape[0] * shape[1]  # a cell of its own behind the picture, left out at the end
    is_inside = (row >= 0) & (row < shape[0]) & (column >= 0) & (column < shape[1])
    pixel = row.astype(np.intp) * shape[1] + column.astype(np.intp)
    pixel[~is_inside] = outside
    nearest = np.full(outside + 1, -np.inf)
    np.maximum.at(nearest, pixel, toward)
    index = np.flatnonzero(toward == nearest[pixel])
    front = np.full(outside + 1, -1, np.intp)
    front[pixel[index]] = index
    return front[:-1].reshape(shape)


def _close_gaps(depth: NDArray[np.float32], front: NDArray[np.intp]) -> None:
    """Give empty pixels enclosed by filled ones the nearest of their neighbours."""
    around = np.pad(depth, 1, constant_values=-np.inf)
    filled = np.isfinite(around).view(np.uint8)
    n_filled = sum(_moved(filled, step, 1) for step in _NEIGHBOURS)
    empty = np.flatnonzero((front < 0) & (n_filled >= _ENCLOSED))
    row, column = np.divmod(empty, depth.shape[1])
    depths = around.ravel()
    nearest, source = np.full(len(empty), -np.inf, np.float32), empty.copy()
    for down, right in _NEIGHBOURS:
        neighbour = depths.take((row + 1 + down) * around.shape[1] + column + 1 + right)
        is_nearer = neighbour > nearest
        np.copyto(nearest, neighbour, where=is_nearer)
        np.copyto(source, empty + (down * depth.shape[1] + right), where=is_nearer)
    depth.ravel()[empty], front.ravel()[empty] = nearest, front.ravel()[source]


def _eye_dome(depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Brightness 0.3 to 1: dark where neighbouring pixels are nearer to the viewer.

    Parameters
    ----------
    depth : (H, W), pixels towards the viewer, minus infinity where nothing is

    References
    ----------
    Boucheny 2009, eye-dome lighting, here with two radii and no light direction.
    """
    floor = np.where(
        np.isfinite(depth), depth, np.float32(np.inf)
    )  # what is empty is behind nothing
    around = np.pad(depth, max(_RADII), constant_values=-np.inf)
    hidden = np.zeros_like(depth)
    nearer = np.empty_like(depth)
    for radius in _RADII:
        for step in _NEIGHBOURS:
            neighbour = _moved(around, (radius * step[0], radius * step[1]), max(_RADII))
            np.subtract(neighbour, floor, out=nearer)
            nearer *= np.float32(1 / radius)
            hidden += np.clip(nearer, 0, 4.0, out=nearer)
    light: NDArray[np.float32] = np.exp(hidden / np.float32(-16.0))
    light *= np.float32(0.7)
    light += np.float32(0.3)
    return light


def _moved(padded: NDArray[_Scalar], step: tuple[int, int], margin: int) -> NDArray[_Scalar]:
    """View of a padded array from which every pixel sees its neighbour at `step`."""
    rows, columns = (size - 2 * margin for size in padded.shape)
    row, column = margin + step[0], margin + step[1]
    return padded[row : row + rows, column : column + columns]
