# SPDX-License-Identifier: MIT OR Apache-2.0
"""A map of our own read back with all that is known of its points, chunk by chunk."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import laspy
import numpy as np

from bentwing.base.errors import InputError
from bentwing.base.gps_time import adjusted_gps_origin
from bentwing.map.chunk import MapChunk
from bentwing.map.columns import NORMALS
from bentwing.map.las_bounds import require_sound_las
from bentwing.map.write_las import EXTRA

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

CHUNK_SUFFIXES = (".laz", ".las")
"""Of the formats that keep everything."""
_PART = 500_000


@dataclass(frozen=True, slots=True)
class MapFile:
    """What the header of a map says.

    Attributes
    ----------
    path : the file
    n_points : in it
    low, high : (3,) m, corners of the box around the points
    attributes : names of further fields of the recording
    """

    path: Path
    n_points: int
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    attributes: tuple[str, ...]

    @classmethod
    def open(cls, path: Path) -> MapFile:
        """Read the header.

        Raises
        ------
        InputError
            If it is damaged, or not one of our own.
        """
        require_sound_las(path)
        with laspy.open(path) as file:
            header = file.header
            names = [*header.point_format.extra_dimension_names]
            if "range" not in names:
                msg = (
                    f"{path}: has no ranges, so bentwing did not write it; map the recording again"
                )
                raise InputError(msg)
            ends = np.array(header.mins), np.array(header.maxs)
            return cls(path, header.point_count, *ends, _further(names))

    def chunks(self, clock_origin_ns: int) -> Iterator[MapChunk]:
        """Yield the points with their attributes.

        Parameters
        ----------
        clock_origin_ns : absolute time that becomes zero, ns UTC

        Raises
        ------
        InputError
            If the file is damaged, which may show at its end only.
        """
        origin = adjusted_gps_origin(clock_origin_ns)
        try:
            with laspy.open(self.path) as file:
                for part in file.chunk_iterator(_PART):
                    yield _chunk(part, origin)
        except laspy.errors.LaspyException as error:
            msg = f"{self.path}: cannot be read ({error}); map the recording again"
            raise InputError(msg) from error


def _chunk(part: Any, origin: float) -> MapChunk:  # noqa: ANN401 - the package has no types
    names = tuple(part.point_format.extra_dimension_names)
    extra: dict[str, Any] = {
        name: np.array(part[name], kind) for name, (kind, _) in EXTRA.items() if name in names
    }
    if NORMALS[0] in names:
        extra["normals"] = np.stack([part[name] for name in NORMALS], axis=1)
    if further := _further(names):
        extra["attributes"] = np.empty(len(part), [(n, part[n].dtype) for n in further])
        for name in further:
            extra["attributes"][name] = part[name]
    if "incidence" in extra:
        extra["incidence"] = np.radians(extra["incidence"])
    return MapChunk(
        np.stack([part.x, part.y, part.z], axis=1).astype(np.float64),
        np.array(part.gps_time, np.float64) - origin,
        np.array(part["range"], np.float32),
        np.array(part.intensity, np.float32),
        **extra,
    )


def _further(names: Iterable[str]) -> tuple[str, ...]:
    """Return those of the extra dimensions that are fields of the recording."""
    return tuple(name for name in names if name not in {"range", *EXTRA, *NORMALS})
