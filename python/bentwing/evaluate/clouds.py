# SPDX-License-Identifier: MIT OR Apache-2.0
"""Clouds of any size: streamed, sampled, and relative to a place nearby."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import InputError
from bentwing.map.chunk import MapChunk
from bentwing.map.read import MapPart, read_parts
from bentwing.map.sample import MapSample

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from numpy.typing import NDArray


class Cloud:
    """A map in a file, read again for every use so that it never is in memory as a whole.

    Attributes
    ----------
    path : the file
    georeference : as of `read_parts`, for the map of a run with its trajectory
    origin : (3,) m, whole metres near the first points; all points are given relative to it, so
        that geographic coordinates lose no precision
    n_points, n_not_finite : of which the latter are left out
    has_times : whether the points have times
    sample : an even sample of points (K, 3) and times (K,); the times are zero without any
    """

    def __init__(
        self,
        path: Path,
        sample_limit: int = 600_000,
        georeference: Mapping[str, Any] | None = None,
    ) -> None:
        self.path = path
        self.georeference = georeference
        self.origin: NDArray[np.float64] = np.zeros(3)
        self.n_points = self.n_not_finite = 0
        self.has_times = True
        self.sample = MapSample(sample_limit)
        for part in read_parts(path, georeference):
            self._look_at(part)
        if self.n_points == self.n_not_finite:
            msg = f"{path}: holds no point; give a map with points"
            raise InputError(msg)
        self.has_times = self.has_times and bool(np.ptp(self.sample.times) > 0)

    def parts(self) -> Iterator[NDArray[np.float64]]:
        """Yield finite points `(N, 3)` m, relative to the origin."""
        for part in read_parts(self.path, self.georeference):
            points = part.points[np.isfinite(part.points).all(axis=1)]
            if len(points):
                yield points - self.origin

    def _look_at(self, part: MapPart) -> None:
        finite = np.isfinite(part.points).all(axis=1)
        points = part.points[finite]
        if len(points) and self.n_points == self.n_not_finite:
            self.origin = np.round(np.median(points, axis=0))
        self.n_points += len(part.points)
        self.n_not_finite += int(np.count_nonzero(~finite))
        self.has_times &= part.times is not None
        times = np.zeros(len(points)) if part.times is None else part.times[finite]
        self.sample.add(MapChunk(points - self.origin, times, np.zeros(len(points), np.float32)))
