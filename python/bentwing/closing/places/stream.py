# SPDX-License-Identifier: MIT OR Apache-2.0
"""Places of a run whose points come by once, in the order of measurement, and are not kept."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.closing.places.cut import PAUSE, describe_parts, place_starts, positions_at
from bentwing.closing.places.part import MIN_POINTS, Part
from bentwing.closing.places.settings import PlaceSettings

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.closing.places.place import Place
    from bentwing.map.chunk import MapChunk


def describe_stream(
    chunks: Iterable[MapChunk], trajectory: Trajectory, spans: Sequence[tuple[float, float]]
) -> list[Place]:
    """Describe the places of a stream of points, one place at a time; parameters as of `PartStream`."""
    stream = PartStream(trajectory, spans)
    places: list[Place] = []
    for chunk in chunks:
        places += describe_parts(stream.add(chunk.points, chunk.times))
    return [*places, *describe_parts(stream.finish())]


class PartStream:
    """Cuts a stream of points as `cut_places` cuts them together, holding one place at a time.

    Parameters
    ----------
    trajectory : of the sensor or close to it, on the same clock
    spans : first and last time of each stretch of it that is known, s; no place has points of two
    settings : default: those for all sensors
    """

    def __init__(
        self,
        trajectory: Trajectory,
        spans: Sequence[tuple[float, float]],
        settings: PlaceSettings | None = None,
    ) -> None:
        self._settings = settings or PlaceSettings()
        self._trajectory = trajectory
        self._starts = np.array(
            [t for a, b in spans for t in place_starts(trajectory, a, b, self._settings)]
        )
        self._number = 0
        self._held: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
        self._n_held, self._step = 0, 1

    def add(self, points: NDArray[np.float64], times: NDArray[np.float64]) -> Iterator[Part]:
        """Take points (N, 3), m, with times (N,), s; yields the places that they complete.

        Those outside the trajectory are passed over.
        """
        inside = self._trajectory.covers(times)
        if not inside.all():
            points, times = points[inside], times[inside]
        if not len(times):
            return
        # Beams of a sweep may be a little out of order: a place that is complete stays so.
        numbers = np.maximum.accumulate(np.searchsorted(self._starts, times, side="right"))
        before = self._held[-1][1][-1] if self._held else times[0]
        pauses = np.diff(times, prepend=before) > PAUSE
        changes = np.diff(numbers, prepend=max(self._number, numbers[0])) > 0
        if self._held and numbers[0] > self._number:
            changes[0] = True
        edges = np.flatnonzero(pauses | changes)
        for first, last in zip([0, *edges], [*edges, len(times)], strict=True):
            if first in edges:
                yield from self.finish()
            self._hold(points[first:last], times[first:last])
        self._number = int(numbers[-1])

    def finish(self) -> Iterator[Part]:
        """Yield the last place, if it has enough points."""
        held, self._held, self._n_held, self._step = self._held, [], 0, 1
        if sum(len(times) for _, times in held) < MIN_POINTS:
            return
        points = np.concatenate([p for p, _ in held])
        times = np.concatenate([t for _, t in held])
        origins = positions_at(self._trajectory, times)
        yield Part(points, (float(times.min()), float(times.max())), origins)

    def _hold(self, points: NDArray[np.float64], times: NDArray[np.float64]) -> None:
        if not len(times):
            return
        self._held.append((points[:: self._step], times[:: self._step]))
        self._n_held += len(self._held[-1][1])
        # `make_place` takes every n-th of too many; what it would leave out need not be held.
        while self._n_held > 2 * self._settings.max_points:
            self._held = [(p[::2], t[::2]) for p, t in self._held]
            self._n_held = sum(len(t) for _, t in self._held)
            self._step *= 2
