# SPDX-License-Identifier: MIT OR Apache-2.0
"""The flight as frames of a video: the map grows while the camera follows the sensor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import InputError
from bentwing.base.new_file import require_folder
from bentwing.report.picture import paint, project, thinned, write_png
from bentwing.report.view.pictures import Pictured, read_pictured

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.progress import Progress

    Array = NDArray[np.float64]

WIDTH, HEIGHT = 960, 540  # pixels
_MOST = 2_000_000  # points
_GAPS = 5  # pixels that are closed; near the camera points are far apart
_WIDE = 1.1  # tangent of half the view's width
_BEHIND, _ABOVE = 7.0, 4.5  # m, of the camera from the sensor
_NEAREST = 1.0  # m before the camera
_SMOOTH = 4.0  # s over which the camera's heading and place are averaged
_STEP = 0.04  # m between the points that show the way
_WAY = np.array([200, 51, 30], np.uint8)


@dataclass(frozen=True, slots=True)
class Camera:
    """A perspective camera.

    Attributes
    ----------
    place : (3,) m
    right, up, toward : (3,) unit vectors, the last one to the viewer
    """

    place: Array
    right: Array
    up: Array
    toward: Array


def write_frames(run: Path, out: Path, n: int, progress: Progress) -> list[Path]:
    """Write `n` frames, evenly over the flight, as frame_0001.png and so on.

    Raises
    ------
    UsageError, InputError
        If there is no run, or its map and trajectory do not belong together.
    """
    require_folder(out)
    with progress.stage("reading the map"):
        what = read_pictured(run, _MOST)
    if len(what.trajectory.times) < 2:
        msg = f"{run}: has no trajectory in the frame of its map; frames need both in one"
        raise InputError(msg)
    out.mkdir(parents=True, exist_ok=True)
    points, times = what.points, what.times
    span = tuple(np.percentile(thinned(points[:, 2]), [1, 99]).tolist())
    way, way_times = _way(what)
    written = []
    first, last = what.trajectory.times[[0, -1]]
    moments = np.linspace(first, last, n + 1)[1:]
    with progress.stage("frames", float(n), "frames") as shown:
        for number, moment in enumerate(moments.tolist(), start=1):
            seen = points[: np.searchsorted(times, moment)]
            flown = way[: np.searchsorted(way_times, moment)]
            image = frame(seen, flown, camera_at(what, moment), span)
            written.append(out / f"frame_{number:04d}.png")
            write_png(written[-1], image)
            shown.advance(1.0)
    return written


def camera_at(what: Pictured, moment: float) -> Camera:
    """Look at the sensor from behind and above, as it moved in the seconds around a moment."""
    trajectory = what.trajectory
    around = np.clip(
        moment + np.linspace(-_SMOOTH, _SMOOTH, 17), trajectory.times[0], trajectory.times[-1]
    )
    places, _ = trajectory.interpolate(around)
    target = places.mean(axis=0)
    heading = _heading(trajectory.positions, trajectory.times, moment)
    ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
    place = target - _BEHIND * ahead + np.array([0.0, 0.0, _ABOVE])
    toward = (place - target) / np.linalg.norm(place - target)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    return Camera(place, right, np.cross(toward, right), toward)


def frame(
    points: Array, way: Array, camera: Camera, span: tuple[float, float]
) -> NDArray[np.uint8]:
    """Draw points (N, 3) by height, and the way (M, 3) so far, in perspective."""
    everything = np.concatenate([points, way])
    local = everything - camera.place
    depth = -(local @ camera.toward)
    ahead = np.flatnonzero(depth > _NEAREST)
    depth = depth[ahead]
    across, up = (local[ahead] @ axis / depth for axis in (camera.right, camera.up))
    tall = _WIDE * HEIGHT / WIDTH
    seen = project(
        across,
        up,
        -np.log(depth),  # its differences are shares of the distance, as tangents are
        width=WIDTH,
        max_height=HEIGHT,
        close_gaps=_GAPS,
        frame=(-_WIDE, _WIDE, -tall, tall),
    )
    image = paint(seen, everything[ahead, 2], span=span).image[:HEIGHT, :WIDTH].copy()
    is_way = ahead >= len(points)
    front = seen.front[:HEIGHT, :WIDTH]
    image[(front >= 0) & is_way[front]] = _WAY
    return image


def _way(what: Pictured) -> tuple[Array, Array]:
    """Points along the way, dense enough to look like a line, and their times."""
    positions, times = what.trajectory.positions, what.trajectory.times
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    at = np.arange(0.0, along[-1], _STEP)
    when = np.interp(at, along, times)
    return np.column_stack([np.interp(when, times, axis) for axis in positions.T]), when


def _heading(positions: Array, times: Array, moment: float) -> float:
    """Direction of flight, averaged, that turns slowly and keeps still in hover."""
    grid = np.arange(times[0], times[-1], 1.0)
    places = np.column_stack([np.interp(grid, times, axis) for axis in positions[:, :2].T])
    steps = np.diff(places, axis=0, prepend=places[:1])
    weights = np.exp(-0.5 * ((grid - moment) / _SMOOTH) ** 2)
    ahead = weights @ steps + 1e-9
    return float(np.arctan2(ahead[1], ahead[0]))
