# SPDX-License-Identifier: MIT OR Apache-2.0
"""Maps, points and trajectories as tensors of Open3D, and back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.array_spool import columns_of
from bentwing.base.errors import UsageError
from bentwing.base.trajectory import Trajectory
from bentwing.map.chunk import MapChunk, untimed
from bentwing.odometry.window_result import WindowResult
from bentwing.products.finished_map import open_map_of
from bentwing.products.map_chunks import chunks_of
from bentwing.products.open3d_package import require_open3d
from bentwing.products.oriented import OrientedPoints

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

# Names in Open3D of the columns of a chunk; those of one number for each point.
_COLUMNS = {
    "time": "times",
    "range": "ranges",
    "intensity": "intensity",
    "sigma": "sigma",
    "incidence": "incidence",
    "thickness": "thickness",
    "shift": "shift",
    "ring": "ring",
    "run_id": "run_id",
    "normals": "normals",
}


def to_open3d(
    given: Path | str | MapChunk | Iterable[MapChunk] | OrientedPoints | WindowResult | Trajectory,
) -> Any:  # noqa: ANN401
    """Return a map, points, the surfaces of a window or a trajectory as a tensor geometry of Open3D.

    Parameters
    ----------
    given : folder of a finished run, whose whole map has to fit into memory; points or several chunks of
        them, as `export_points` yields them; what `register_window` returns; or a trajectory

    Returns
    -------
    Of points an `open3d.t.geometry.PointCloud` with float64 `positions` in the coordinates given, of a run
    those of its map's file, and where they are known `time` (s), `intensity`, `sigma` (m), `range` (m) and the
    other columns of `MapChunk`, attributes of the recording included, each (N, 1), and `normals` (N, 3).
    Of a window its surfels, with `normals`, `time` and `edge` (m). Of a trajectory an
    `open3d.t.geometry.LineSet` through its poses, whose points have `time` and `quaternion` (x, y, z, w).

    Raises
    ------
    UsageError
        If Open3D is not installed, or the folder holds no complete run.
    InputError
        If a run has no map.
    """
    o3d = require_open3d()
    if isinstance(given, Trajectory):
        return _lines(o3d, given)
    if isinstance(given, OrientedPoints):
        columns = {"normals": given.normals.astype(np.float32), "intensity": given.intensity}
        return _cloud(o3d, given.points, columns)
    if isinstance(given, WindowResult):
        seen = given.surfels
        return _cloud(
            o3d, seen.points, {"normals": seen.normals, "time": seen.times, "edge": seen.edges}
        )
    if isinstance(given, (str, Path)):
        chunk = _whole(given)
    else:
        chunk = given if isinstance(given, MapChunk) else _joined(given)
    columns = {n: getattr(chunk, field) for n, field in _COLUMNS.items()}
    attributes = chunk.attributes
    if attributes is not None:
        columns |= {name: attributes[name] for name in attributes.dtype.names or ()}
    return _cloud(o3d, chunk.points, columns)


def from_open3d(geometry: Any) -> MapChunk | Trajectory:  # noqa: ANN401 - Open3D has no types
    """Return what Open3D has: a cloud as points of a map, lines through timed poses as a trajectory.

    Parameters
    ----------
    geometry : `PointCloud` or `LineSet` of `open3d.t.geometry`, or a legacy `PointCloud`. What a cloud does
        not have is None; times and ranges are then zero

    Raises
    ------
    UsageError
        If it is something else, or lines without `time` and `quaternion`, as `to_open3d` makes them.
    """
    o3d = require_open3d()
    if isinstance(geometry, o3d.geometry.PointCloud):
        geometry = o3d.t.geometry.PointCloud.from_legacy(geometry, o3d.core.float64)
    if isinstance(geometry, o3d.t.geometry.PointCloud):
        return _chunk(geometry)
    if not isinstance(geometry, o3d.t.geometry.LineSet):
        msg = f"{type(geometry).__name__} is neither a point cloud nor a line set of Open3D"
        raise UsageError(msg)
    if not {"time", "quaternion"} <= set(geometry.point):
        msg = "the line set is no trajectory; its points need `time` and `quaternion`"
        raise UsageError(msg)
    values = geometry.point
    return Trajectory(
        values["time"].numpy().ravel().astype(np.float64),
        values["positions"].numpy().astype(np.float64),
        values["quaternion"].numpy().astype(np.float64),
    )


def _whole(run: Path | str) -> MapChunk:
    """Read the whole map of a run."""
    source = open_map_of(run)
    whole = _joined(chunks_of(source))
    return replace(whole, points=whole.points + source.origin)


def _joined(chunks: Iterable[MapChunk]) -> MapChunk:
    """Join chunks; a column has to be in all of them."""
    tables = [columns_of(chunk) for chunk in chunks]
    if not tables:
        return untimed(np.empty((0, 3)))
    common = set.intersection(*map(set, tables))
    return MapChunk(**{name: np.concatenate([t[name] for t in tables]) for name in common})


def _cloud(
    o3d: Any,  # noqa: ANN401
    points: NDArray[np.float64],
    columns: Mapping[str, NDArray[Any] | None],
) -> Any:  # noqa: ANN401
    cloud = o3d.t.geometry.PointCloud(_tensor(o3d, points))
    for name, values in columns.items():
        if values is not None:
            cloud.point[name] = _tensor(o3d, values.reshape(len(points), -1))
    return cloud


def _lines(o3d: Any, trajectory: Trajectory) -> Any:  # noqa: ANN401
    first = np.arange(max(len(trajectory) - 1, 0), dtype=np.int32)
    lines = o3d.t.geometry.LineSet(
        _tensor(o3d, trajectory.positions), _tensor(o3d, np.column_stack([first, first + 1]))
    )
    lines.point["time"] = _tensor(o3d, trajectory.times[:, None])
    lines.point["quaternion"] = _tensor(o3d, trajectory.quats_xyzw)
    return lines


def _tensor(o3d: Any, values: NDArray[Any]) -> Any:  # noqa: ANN401
    return o3d.core.Tensor(np.ascontiguousarray(values))


def _chunk(cloud: Any) -> MapChunk:  # noqa: ANN401
    points = cloud.point["positions"].numpy().astype(np.float64)
    columns: dict[str, Any] = {
        "times": np.zeros(len(points)),
        "ranges": np.zeros(len(points), np.float32),
    }
    for name, field in _COLUMNS.items():
        if name in cloud.point:
            values = cloud.point[name].numpy()
            columns[field] = values.astype(np.float32) if name == "normals" else values.ravel()
    columns["times"] = columns["times"].astype(np.float64)
    columns["attributes"] = _further(cloud)
    return MapChunk(points, **columns)


def _further(cloud: Any) -> NDArray[np.void] | None:  # noqa: ANN401
    """Return the columns of one number for each point that a chunk does not have by name."""
    others = set(cloud.point) - {"positions", *_COLUMNS}
    values = {name: cloud.point[name].numpy() for name in sorted(others)}
    single = {name: v.ravel() for name, v in values.items() if v.ndim == 2 and v.shape[1] == 1}
    if not single:
        return None
    table = np.empty(len(cloud.point["positions"]), [(name, v.dtype) for name, v in single.items()])
    for name, v in single.items():
        table[name] = v
    return table
