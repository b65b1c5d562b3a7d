# SPDX-License-Identifier: MIT OR Apache-2.0
"""Points where they most probably are: moved along their beams to the surface that they measured together."""

from __future__ import annotations

from contextlib import ExitStack, closing
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing import _core
from bentwing.base.array_spool import ArraySpool, columns_of
from bentwing.base.memory import give_back
from bentwing.map.chunk import MapChunk, beams_of
from bentwing.map.slabs import Extent
from bentwing.recording.preprocess.read_ahead import read_ahead

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.map.slabs import Slabs

EDGE = 0.05  # m, of the smallest cells
N_LEVELS = 4  # sizes of cells, each twice as large as the one before
ENOUGH = 80  # points around the middle of a cell; fewer are averaged too little
FEWEST_PASSES = 5.0  # effective number that must have seen a surface
MOST_NOISE = 0.03  # m, of a range; what looks noisier is the shape of things
# s; what is measured within it shares the error of the trajectory. A head that turns sees a surface in it
# once.
PASS_LENGTH = 0.25
MOST_POINTS = 5_000_000  # that are looked at together, about 75 bytes each
_HELD = 32_000_000  # bytes of moves that need no file
_PARTS_AHEAD = 8  # chosen while those before them go to the disk
_NEEDED = ("points", "beams", "ranges", "times")
_STEP = 1e-4  # m, of the histograms of moves and standard deviations
_N_STEPS = 1000


def refine(
    chunks: Iterable[MapChunk],
    folder: Path,
    *,
    counts: dict[str, int] | None = None,
    record: dict[str, Any] | None = None,
    threads: int | None = None,
) -> Generator[MapChunk, None, None]:
    """Move every point along its own beam to where it most probably is.

    All chunks pass once before the first one comes out; meanwhile they are on the disk. A large map is
    refined in slabs, with the points around each.

    Parameters
    ----------
    chunks : with the beams of their points and the ranges as measured
    folder : of the temporary files, about 100 bytes per point
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
        extent = Extent()
        for chunk in filter(len, chunks):
            beams_of(chunk)
            extent.add(chunk.points)
            spool.add(columns_of(chunk))
        slabs = extent.slabs(MOST_POINTS)
        groups = [stack.enter_context(ArraySpool(folder)) for _ in range(slabs.n_groups)]
        sizes = _distribute(spool, slabs, groups)
        held = _HELD // max(len(groups), 1)
        refined = [stack.enter_context(ArraySpool(folder, held=held)) for _ in groups]
        noise: _core.RangeNoise | None = None
        # Of the largest group the noise is learnt.
        for number in sorted(range(len(groups)), key=lambda number: -sum(sizes[number])):
            give_back()  # of the group before
            found = _sample(groups[number]).refine(noise=noise, threads=threads or 0)
            groups[number].close()
            noise, shift, sigma = found or _unmoved(noise, sum(sizes[number]))
            for rows in _pieces(sizes[number]):
                refined[number].add({"shift": shift[rows], "sigma": sigma[rows]})
        moves = [own.tables() for own in refined]
        for columns in spool.tables():
            chunk = MapChunk(**columns)
            moved = _moved(chunk, slabs, moves)
            tally.add(moved, noise)
            yield moved
    if counts is not None:
        counts["map.refined"] = tally.n_moved
    if record is not None:
        record.update(tally.to_json())


def _distribute(spool: ArraySpool, slabs: Slabs, groups: list[ArraySpool]) -> list[list[int]]:
    """Give each group its points; return how many of each chunk are the group's own."""
    sizes: list[list[int]] = [[] for _ in groups]
    with closing(read_ahead(_parts(spool, slabs), _PARTS_AHEAD)) as parts:
        for number, columns in parts:
            groups[number].add(columns)
            sizes[number].append(int(np.count_nonzero(columns["own"])))
    return sizes


def _parts(
    spool: ArraySpool, slabs: Slabs
) -> Generator[tuple[int, dict[str, NDArray[Any]]], None, None]:
    for columns in spool.tables():
        needed = {name: columns[name] for name in _NEEDED}
        words = _core.shot_words(**needed, edge=EDGE, pass_length=PASS_LENGTH)
        for part in slabs.parts(columns["points"]):
            yield part.number, {"words": words.take(part.rows, axis=0), "own": part.own}


def _sample(group: ArraySpool) -> _core.SurfaceSample:
    sample = _core.SurfaceSample(
        edge=EDGE,
        n_levels=N_LEVELS,
        enough=ENOUGH,
        fewest_passes=FEWEST_PASSES,
        most_noise=MOST_NOISE,
    )
    for columns in group.tables():
        sample.add(**columns)
    return sample


def _unmoved(
    noise: _core.RangeNoise | None, n: int
) -> tuple[_core.RangeNoise | None, NDArray[np.float32], NDArray[np.float32]]:
    """Return what is known of points without surfaces."""
    return noise, np.zeros(n, np.float32), np.full(n, np.nan, np.float32)


def _pieces(sizes: list[int]) -> Iterator[slice]:
    ends = np.cumsum([0, *sizes]).tolist()
    return map(slice, ends[:-1], ends[1:])


def _moved(
    chunk: MapChunk, slabs: Slabs, moves: list[Iterator[dict[str, NDArray[np.float32]]]]
) -> MapChunk:
    shift, sigma = np.empty(len(chunk), np.float32), np.empty(len(chunk), np.float32)
    for part in slabs.parts(chunk.points):
        found, own = next(moves[part.number]), part.rows[part.own]
        shift[own], sigma[own] = found["shift"], found["sigma"]
    points = chunk.points + beams_of(chunk) * shift[:, None].astype(np.float64)
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
