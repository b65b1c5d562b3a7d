# SPDX-License-Identifier: MIT OR Apache-2.0
"""Read the points of a map back, ours or one of another program, whole or part by part."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import BentwingError, InputError
from bentwing.base.value import Value
from bentwing.map.read_e57 import e57_scans
from bentwing.map.read_rows import PART, pcd_rows, ply_rows

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from numpy.typing import NDArray

    Table = tuple[NDArray[np.float64], NDArray[np.float64] | None]


@dataclass(frozen=True, slots=True, eq=False)
class MapPart(Value):
    """Some points of a map.

    Attributes
    ----------
    points : (N, 3) float64, m
    times : (N,) float64, s on the file's own clock, None where the file has no times
    """

    points: NDArray[np.float64]
    times: NDArray[np.float64] | None


def read_points(path: Path | str) -> NDArray[np.float64]:
    """Read the coordinates of a whole map; see `read_parts`.

    Returns
    -------
    (N, 3) float64, m
    """
    parts = [part.points for part in read_parts(path)]
    return np.concatenate(parts) if parts else np.empty((0, 3))


def read_parts(
    path: Path | str, georeference: Mapping[str, Any] | None = None
) -> Iterator[MapPart]:
    """Read a .laz, .las, .ply, .pcd or .e57 file in parts that fit into memory.

    Parameters
    ----------
    path : the file
    georeference : what the record of the map's run says about its place on the Earth; the points
        then come back to the frame of the run's trajectory, to some millimetres in 300 m

    Raises
    ------
    InputError
        If the file is of another kind, damaged or truncated, which may show at its end only.
    """
    path = Path(path)
    if not path.exists():
        msg = f"{path}: no such file or folder"
        raise InputError(msg)
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        msg = f"{path}: maps are read from {', '.join(_READERS)} files; convert it first"
        raise InputError(msg)
    try:
        for points, times in reader(path):
            yield MapPart(_in_map_frame(points, georeference), times)
    except BentwingError:
        raise
    except Exception as error:
        # Parsers of foreign files fail in every way there is; the file is what the user can change.
        msg = f"{path}: not readable as {path.suffix.lower()[1:].upper()} ({error})"
        raise InputError(msg) from error


def _in_map_frame(
    points: NDArray[np.float64], georeference: Mapping[str, Any] | None
) -> NDArray[np.float64]:
    if not georeference:
        return points
    linear = {name: np.array(value) for name, value in georeference["linear"].items()}
    inverse = np.linalg.inv(linear["matrix"])
    local: NDArray[np.float64] = (points - linear["projected"]) @ inverse.T + linear["map"]
    return local


def _las_parts(path: Path) -> Iterator[Table]:
    import laspy  # PLY and PCD are read without it

    with laspy.open(path) as file:
        has_times = "gps_time" in file.header.point_format.dimension_names
        n = 0
        for part in file.chunk_iterator(PART):
            n += len(part)
            points = np.stack([part.x, part.y, part.z], axis=1).astype(np.float64)
            yield points, np.array(part.gps_time, np.float64) if has_times else None
        if n != file.header.point_count:
            msg = f"{path}: announces {file.header.point_count} points, holds {n}; it is truncated"
            raise InputError(msg)


_READERS: dict[str, Callable[[Path], Iterator[Table]]] = {
    ".laz": _las_parts,
    ".las": _las_parts,
    ".ply": ply_rows,
    ".pcd": pcd_rows,
    ".e57": e57_scans,
}

MAP_SUFFIXES = tuple(_READERS)
