# SPDX-License-Identifier: MIT OR Apache-2.0
"""What all map writers share: fed chunk by chunk, visible under the final name only when whole."""

from __future__ import annotations

from abc import ABC, abstractmethod
from contextlib import nullcontext, suppress
from typing import TYPE_CHECKING, cast

import numpy as np

from bentwing.base.atomic import publish, temporary_name, writing
from bentwing.base.progress import Progress
from bentwing.map.chunk import MapChunk
from bentwing.map.formats import FORMATS, load, require_format

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType

    from numpy.typing import NDArray
    from typing_extensions import Self

_OFFSET_STEP = 1000.0  # m; a local map gets offset 0, a georeferenced one a round number


class MapWriter(ABC):
    """Context manager that writes one map file.

    The columns are those of the first chunk. On an exception inside the context the temporary
    file is removed, and whatever stood under the final name stays as it was.

    Parameters
    ----------
    path : the final name
    clock_origin_ns : absolute time of `times == 0`, ns UTC
    crs_wkt : the coordinate reference system of the points as WKT 1, None for a frame of their own

    Attributes
    ----------
    progress : of what is left to do when all points are known; says nothing unless it is set
    """

    def __init__(self, path: Path, clock_origin_ns: int, crs_wkt: str | None = None) -> None:
        self.path = path
        self.clock_origin_ns = clock_origin_ns
        self.crs_wkt = crs_wkt
        self.n_points = 0
        self.progress = Progress()
        self._temporary = temporary_name(path)
        self._open = False

    def __enter__(self) -> Self:
        return self

    def write(self, chunk: MapChunk) -> None:
        """Append the points of a chunk."""
        with writing(self.path):
            if not self._open:
                self._begin(chunk)
                self._open = True
            self._append(chunk)
        self.n_points += len(chunk)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            if kind is None:
                if not self._open:
                    self.write(_EMPTY)
                with writing(self.path):
                    self._finish()
                    publish(self._temporary, self.path)
            elif self._open:
                self._give_up(error)
        finally:
            self._temporary.unlink(missing_ok=True)

    def _give_up(self, error: BaseException | None) -> None:
        """Close the file; where it cannot be written, closing it fails once more."""
        with suppress(OSError) if isinstance(error, OSError) else nullcontext():
            self._abandon()

    @abstractmethod
    def _begin(self, first: MapChunk) -> None:
        """Open the temporary file and write what stands before the points."""

    @abstractmethod
    def _append(self, chunk: MapChunk) -> None:
        """Write the points of a chunk."""

    @abstractmethod
    def _finish(self) -> None:
        """Write what is known only at the end and close the file."""

    @abstractmethod
    def _abandon(self) -> None:
        """Close the file without caring for its content."""


def open_map(
    path: Path, map_format: str, clock_origin_ns: int, crs_wkt: str | None = None
) -> MapWriter:
    """Writer of a map in one of `MAP_FORMATS`; the parameters are those of `MapWriter`.

    Raises
    ------
    UsageError
        If the format is unknown or needs a package that is not installed.
    """
    writer = load(FORMATS[require_format(map_format)].writer)
    return cast("MapWriter", writer(path, clock_origin_ns, crs_wkt))


def round_offset(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return whole kilometres (3,) near the middle of points: 0 for a local map."""
    middle = np.median(points, axis=0) if len(points) else np.zeros(3)
    offset: NDArray[np.float64] = np.round(middle / _OFFSET_STEP) * _OFFSET_STEP
    return offset


_EMPTY = MapChunk(np.empty((0, 3)), np.empty(0), np.empty(0, np.float32))
