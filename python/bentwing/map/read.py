# SPDX-License-Identifier: MIT OR Apache-2.0
"""Read the points of a map back, ours or one of another program, whole or part by part."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import BentwingError, InputError
from bentwing.base.regular_file import require_regular, require_there
from bentwing.base.value import Value
from bentwing.map.formats import FORMATS, MAP_SUFFIXES, load

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray


_LONGEST = 200  # characters of what a library says


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
    """Read a file of one of `MAP_FORMATS` in parts that fit into memory.

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
    require_there(path)
    require_regular(path)
    suffix = path.suffix.lower()
    reader = next((f.reader for name, f in FORMATS.items() if suffix == f".{name}"), None)
    if reader is None:
        msg = f"{path}: maps are read from {', '.join(MAP_SUFFIXES)} files; convert it first"
        raise InputError(msg)
    try:
        for points, times in load(reader)(path):
            yield MapPart(_in_map_frame(points, georeference), times)
    except BentwingError:
        raise
    except Exception as error:
        # Parsers of foreign files fail in every way there is; the file is what the user can change.
        # Some libraries go on for lines about where in their sources they were.
        what = (str(error).strip() or type(error).__name__).splitlines()[0][:_LONGEST]
        msg = f"{path}: not readable as {suffix[1:].upper()} ({what})"
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
