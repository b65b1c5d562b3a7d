# SPDX-License-Identifier: MIT OR Apache-2.0
"""An even sample of a map of unknown size, for pictures and statistics."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable

    from numpy.typing import NDArray

    from bentwing.map.chunk import MapChunk


VALUES = ("sigma", "intensity", "incidence")
"""What a sample keeps of its points beside place and time: m, as the sensor reports it, rad."""


class MapSample:
    """Every k-th point of what passes by, as measured, k doubled whenever more than `limit` were kept.

    By the points as they were measured the trajectory is judged; refined ones would flatter it.

    Parameters
    ----------
    limit : the sample holds at most this many points, and at least half as many if there were
    """

    def __init__(self, limit: int = 1_200_000) -> None:
        self._limit = limit
        self._step = 1
        self._next = 0  # how many points still pass before the next is kept
        self._points: list[NDArray[np.float64]] = []
        self._times: list[NDArray[np.float64]] = []
        self._values: list[NDArray[np.float32]] = []
        self._n = 0

    @property
    def points(self) -> NDArray[np.float64]:
        """Sampled points, (K, 3) m, map frame."""
        return np.concatenate(self._points) if self._points else np.empty((0, 3))

    @property
    def times(self) -> NDArray[np.float64]:
        """Times of the sampled points, (K,) s since the recording's start."""
        return np.concatenate(self._times) if self._times else np.empty(0)

    @property
    def values(self) -> NDArray[np.float32]:
        """`VALUES` of the sampled points, (K, 3) float32, NaN where they are not known."""
        return np.concatenate(self._values) if self._values else np.empty((0, len(VALUES)), "<f4")

    def watch(self, chunks: Iterable[MapChunk]) -> Generator[MapChunk, None, None]:
        """Pass a stream of chunks on unchanged, sampling it."""
        for chunk in chunks:
            self.add(chunk)
            yield chunk

    def add(self, chunk: MapChunk) -> None:
        """Take the share of a chunk that belongs to the sample."""
        chosen = slice(self._next, None, self._step)
        taken = chunk.where(chosen)
        self._next += len(taken) * self._step - len(chunk)
        self._points.append(taken.measured.copy())
        self._times.append(taken.times.copy())
        self._values.append(_values_of(taken))
        self._n += len(taken)
        while self._n > self._limit:
            self._halve()

    def _halve(self) -> None:
        points, times, values = self.points[::2], self.times[::2], self.values[::2]
        if self._n % 2:  # the last point stayed, so the next one is a whole new step away
            self._next += self._step
        self._step *= 2
        self._points, self._times, self._values = [points], [times], [values]
        self._n = len(points)


def _values_of(chunk: MapChunk) -> NDArray[np.float32]:
    values = np.full((len(chunk), len(VALUES)), np.nan, np.float32)
    for column, name in enumerate(VALUES):
        known = getattr(chunk, name)
        if known is not None:
            values[:, column] = known
    return values
