# SPDX-License-Identifier: MIT OR Apache-2.0
"""Points where they most probably are: moved along their beams to the surface that they measured together."""

from __future__ import annotations

from collections import Counter
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing import _core
from bentwing.base.array_spool import ArraySpool, columns_of
from bentwing.map.chunk import MapChunk

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

EDGE = 0.05  # m, of the smallest cells
N_LEVELS = 4  # sizes of cells, each twice as large as the one before
ENOUGH = 80  # points around the middle of a cell; fewer are averaged too little
FEWEST_PASSES = 5.0  # effective number that must have seen a surface
MOST_NOISE = 0.03  # m, of a range; what looks noisier is the shape of things
# s; what is measured within it shares the error of the trajectory. A head that turns sees a surface in it
# once.
PASS_LENGTH = 0.25
MOST_POINTS = 3_000_000  # that surfaces are found from at a time, about 150 bytes each
# m; surfaces reach one and a half of the largest cells from their middle, which may be a cell away.
HALO = 1.5
_HELD = 32_000_000  # bytes of moves that need no file
_STEP = 1e-4  # m, of the histograms of moves and standard deviations
_N_STEPS = 1000


def refine(
    chunks: Iterable[MapChunk],
    folder: Path,
    *,
    counts: dict[str, int] | None = None,
    record: dict[str, Any] | None = None,
    threads: int | None = None,
) -> Iterator[MapChunk]:
    """Move every point along its own beam to where it most probably is.

    All chunks pass once before the first one comes out; meanwhile they are on the disk. A large map is
    refined in slabs.

    Parameters
    ----------
    chunks : with the beams of their points and the ranges as measured
    folder : of the temporary file, about 70 bytes per point
    counts : receives `map.refined`, the points that were moved
    record : receives `moved`, the share, and its medians `move`, `sigma_before` and `sigma`, m
    threads : default: all cores

    Yields
    ------
    The chunks with points that are moved, and with `shift` and `sigma`; `ranges` stay as measured.
    """
    tally = Tally()
    with ExitStack() as stack:
        spool = stack.enter_context(ArraySpool(folder))
        layout = _Layout()
        for chunk in filter(len, chunks):
            layout.add(chunk)
            spool.add(columns_of(chunk))
        slabs = layout.slabs()
        refined = [stack.enter_context(ArraySpool(folder, held=_HELD // len(slabs))) for _ in slabs]
        noise: _core.RangeNoise | None = None
        for slab in sorted(slabs, key=lambda slab: -slab.n_points):
            near = layout.near(slab)
            tables = lambda near=near: map(_chunk, spool.tables(near))  # noqa: E731 - as short as a name
            surfaces = _surfaces(tables, slab, noise, threads or 0)
            noise = noise if surfaces is None else surfaces.noise
            for found in _moves(tables, slab, surfaces, threads or 0):
                refined[slab.number].add(found)
        moves = [own.tables() for own in refined]
        for columns in spool.tables():
            moved = _moved(_chunk(columns), slabs, moves)
            tally.add(moved, noise)
            yield moved
    if counts is not None:
        counts["map.refined"] = tally.n_moved
    if record is not None:
        record.update(tally.to_json())


@dataclass(frozen=True, slots=True)
class _Slab:
    """Points between two coordinates along an axis; the first and the last slab go on without end."""

    number: int
    axis: int
    low: float
    high: float
    n_points: int

    def holds(self, points: NDArray[np.float64], halo: float = 0.0) -> NDArray[np.bool_]:
        along = points[:, self.axis]
        inside: NDArray[np.bool_] = (along >= self.low - halo) & (along < self.high + halo)
        return inside


class _Layout:
    """How many points there are in every metre along each axis."""

    def __init__(self) -> None:
        self._axes: tuple[Counter[int], ...] = (Counter(), Counter(), Counter())
        self._bounds: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []

    def add(self, chunk: MapChunk) -> None:
        self._bounds.append((chunk.points.min(axis=0), chunk.points.max(axis=0)))
        for axis, counted in enumerate(self._axes):
            metres, numbers = np.unique(np.floor(chunk.points[:, axis]), return_counts=True)
            counted.update(dict(zip(metres.astype(int).tolist(), numbers.tolist(), strict=True)))

    def near(self, slab: _Slab) -> list[int]:
        """Return the numbers of the chunks of which some may be in a slab or around it."""
        low, high, axis = slab.low - HALO, slab.high + HALO, slab.axis
        return [i for i, (a, b) in enumerate(self._bounds) if a[axis] < high and b[axis] >= low]

    def slabs(self) -> list[_Slab]:
        """Cut along the longest axis, so that a slab has `MOST_POINTS` where a metre has not more."""
        axis = int(np.argmax([len(counted) for counted in self._axes]))
        cuts, sizes = [-np.inf], [0]
        for metre, number in sorted(self._axes[axis].items()):
            if sizes[-1] and sizes[-1] + number > MOST_POINTS:
                cuts.append(float(metre))
                sizes.append(0)
            sizes[-1] += number
        ends = [*cuts[1:], np.inf]
        return [
            _Slab(i, axis, low, high, size)
            for i, (low, high, size) in enumerate(zip(cuts, ends, sizes, strict=True))
        ]


def _surfaces(
    tables: Callable[[], Iterator[MapChunk]],
    slab: _Slab,
    noise: _core.RangeNoise | None,
    threads: int,
) -> _core.Surfaces | None:
    """Find the surfaces in a slab and around it; of too many points every k-th tells them."""
    every = -(-slab.n_points // MOST_POINTS)
    sample = _core.SurfaceSample(
        edge=EDGE,
        n_levels=N_LEVELS,
        enough=ENOUGH,
        fewest_passes=FEWEST_PASSES,
        most_noise=MOST_NOISE,
        pass_length=PASS_LENGTH,
    )
    for chunk in tables():
        chosen = slab.holds(chunk.points, HALO)
        chosen &= np.cumsum(chosen) % every == 0
        near = chunk.where(chosen)
        sample.add(near.points, beams=_beams(near), ranges=near.ranges, times=near.times)
    return sample.fit(noise=noise, threads=threads)


def _moves(
    tables: Callable[[], Iterator[MapChunk]],
    slab: _Slab,
    surfaces: _core.Surfaces | None,
    threads: int,
) -> Iterator[dict[str, NDArray[np.float32]]]:
    """Yield how far the points of a slab move, and the standard deviation that is left."""
    for chunk in tables():
        own = chunk.where(slab.holds(chunk.points))
        if surfaces is None:
            shift, sigma = np.zeros(len(own), np.float32), np.full(len(own), np.nan, np.float32)
        else:
            shift, sigma = surfaces.refine(
                own.points, beams=_beams(own), ranges=own.ranges, threads=threads
            )
        if len(own):
            yield {"shift": shift, "sigma": sigma}


def _moved(
    chunk: MapChunk, slabs: list[_Slab], moves: list[Iterator[dict[str, NDArray[np.float32]]]]
) -> MapChunk:
    shift, sigma = np.empty(len(chunk), np.float32), np.empty(len(chunk), np.float32)
    for slab in slabs:
        inside = slab.holds(chunk.points)
        if inside.any():
            found = next(moves[slab.number])
            shift[inside], sigma[inside] = found["shift"], found["sigma"]
    points = chunk.points + _beams(chunk) * shift[:, None].astype(np.float64)
    return replace(chunk, points=points, shift=shift, sigma=sigma)


class Tally:
    """How many points were moved, and how far."""

    def __init__(self) -> None:
        self.n_points = self.n_moved = 0
        self._shifts = np.zeros(_N_STEPS, np.int64)
        self._sigmas = np.zeros(_N_STEPS, np.int64)
        self._before = np.zeros(_N_STEPS, np.int64)

    def add(self, chunk: MapChunk, noise: _core.RangeNoise | None) -> None:
        """Count a refined chunk."""
        self.n_points += len(chunk)
        if chunk.shift is None or chunk.sigma is None or noise is None:
            return
        moved = chunk.shift != 0
        self.n_moved += int(np.count_nonzero(moved))
        self._shifts += _histogram(np.abs(chunk.shift[moved]))
        self._sigmas += _histogram(chunk.sigma[moved])
        self._before += _histogram(noise.sigmas(chunk.ranges[moved]))

    def to_json(self) -> dict[str, float | None]:
        """Return the share that was moved, and its medians, m: of the moves, and of the standard deviations."""
        share = self.n_moved / self.n_points if self.n_points else None
        return {
            "moved": share,
            "move": _median(self._shifts),
            "sigma_before": _median(self._before),
            "sigma": _median(self._sigmas),
        }


def _histogram(values: NDArray[np.float32]) -> NDArray[np.int64]:
    steps = np.minimum(values / _STEP, _N_STEPS - 1).astype(np.int64)
    return np.bincount(steps, minlength=_N_STEPS)


def _median(histogram: NDArray[np.int64]) -> float | None:
    total = int(histogram.sum())
    if not total:
        return None
    return _STEP * (int(np.searchsorted(np.cumsum(histogram), total / 2)) + 0.5)


def _chunk(columns: dict[str, NDArray[Any]]) -> MapChunk:
    return MapChunk(**columns)


def _beams(chunk: MapChunk) -> NDArray[np.float32]:
    if chunk.beams is None:
        msg = "chunk.beams: expected the direction of every beam, got None"
        raise ValueError(msg)
    return chunk.beams
