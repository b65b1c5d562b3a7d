# SPDX-License-Identifier: MIT OR Apache-2.0
"""Writes the map of one run or of several: project, clean, refine, thin, write."""

from __future__ import annotations

from collections import Counter
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.clock import NS_PER_S
from bentwing.base.memory import give_back
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.revisits import revisit_consistency
from bentwing.map.chunk import untimed
from bentwing.map.clean import clean
from bentwing.map.normals import moved, with_normals
from bentwing.map.refine import refine
from bentwing.map.sample import MapSample
from bentwing.map.thin import thin
from bentwing.map.writer import open_map
from bentwing.recording.preprocess.read_ahead import read_ahead
from bentwing.run.found import WrittenMap

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.estimate import Estimate
    from bentwing.closing.localize import Difference
    from bentwing.map.chunk import MapChunk
    from bentwing.map.writer import MapWriter
    from bentwing.run.folder import RunFolder
    from bentwing.run.found import Placed
    from bentwing.run.settings import MapSettings

# Each stage works at these while the next one works at those before them.
_CHUNKS_AHEAD = 2
_PAUSE = 10.0  # s between runs that are shown one after the other


@dataclass(frozen=True, slots=True)
class MapSource:
    """A run whose points go into a map.

    Attributes
    ----------
    estimate : of the run, in the frame of the map
    start_ns : time zero of its recording, ns UTC
    chunks : reads the recording and projects it; counts what it does
    """

    estimate: Estimate
    start_ns: int
    chunks: Callable[[dict[str, int]], Iterator[MapChunk]]


def write_map(
    folder: RunFolder,
    sources: Sequence[MapSource],
    settings: MapSettings,
    *,
    duration: float,
    placed: Placed | None = None,
    difference: Difference | None = None,
) -> WrittenMap:
    """Write the cleaned and thinned points of all sources into one map.

    In the file points have the times of their recordings. Where they are cleaned and in the sample
    the runs follow each other.

    Parameters
    ----------
    duration : s, of all recordings together
    placed : where the map is on the Earth, or in the coordinates of a prior map
    difference : watches the points for what has changed since a prior map
    """
    origin_ns, late = clock_of(sources)
    path, sample = folder.file(f"map.{settings.map_format}"), MapSample()
    counts: dict[str, int] = {}
    record: dict[str, Any] = {}
    with ExitStack() as stack:

        def ahead(chunks: Generator[MapChunk, None, None]) -> Generator[MapChunk, None, None]:
            return stack.enter_context(closing(read_ahead(chunks, _CHUNKS_AHEAD)))

        chunks = clean(
            ahead(in_turn(sources, counts)),
            folder.path,
            duration=duration,
            settings=settings.cleaning,
            counts=counts,
            record=record,
            threads=settings.threads,
        )
        if difference is not None:
            chunks = difference.watch(chunks)
        if settings.refine:
            refined: dict[str, Any] = {}
            record["refinement"] = refined
            chunks = refine(
                ahead(chunks), folder.path, counts=counts, record=refined, threads=settings.threads
            )
        if settings.normals:
            chunks = with_normals(ahead(chunks), folder.path)
        kept = ahead(sample.watch(thin(chunks, settings.map_spacing, counts)))
        writer = stack.enter_context(_open(path, settings, origin_ns, placed))
        for chunk in kept:
            timed = with_own_times(chunk, late)
            writer.write(timed if placed is None else moved(timed, placed.to_projected))
    give_back()  # what is compared now is as much again
    counts["map.written"] = writer.n_points
    points = sample.points
    revisits = revisit_consistency(points, sample.times) if len(points) else None
    if difference is None:
        return WrittenMap(path, counts, record, sample, revisits)
    change = difference.change
    clouds = {"appeared": change.appeared, "disappeared": change.disappeared}
    for name, points in clouds.items():
        changed = folder.file(f"{name}.{settings.map_format}")
        with _open(changed, settings, origin_ns, placed) as writer:
            writer.write(untimed(_projected(points, placed)))
    return WrittenMap(path, counts, record, sample, revisits, change, difference.record)


def clock_of(sources: Sequence[MapSource]) -> tuple[int, NDArray[np.float64]]:
    """Return time zero of a map, ns UTC, and s by which each run's recording is later than it is shown."""
    origin_ns = min(source.start_ns for source in sources)
    offsets = follow_each_other([source.estimate for source in sources])
    starts = [(source.start_ns - origin_ns) / NS_PER_S for source in sources]
    return origin_ns, np.subtract(starts, offsets)


def with_own_times(chunk: MapChunk, late: NDArray[np.float64]) -> MapChunk:
    """Give points the times of their recordings, instead of those of runs that follow each other."""
    return replace(chunk, times=chunk.times + late[chunk.run_id]) if late.any() else chunk


def follow_each_other(estimates: Sequence[Estimate]) -> list[float]:
    """Return the seconds to add to the times of each run so that the runs follow each other."""
    offsets: list[float] = []
    end = 0.0
    for estimate in estimates:
        times = estimate.trajectory.times
        offsets.append(end - float(times[0]) if offsets else 0.0)
        end = offsets[-1] + float(times[-1]) + _PAUSE
    return offsets


def joined_trajectory(estimates: Sequence[Estimate]) -> Trajectory:
    """Return the trajectories of all runs as if they had followed each other."""
    offsets = follow_each_other(estimates)
    parts = [(e.trajectory.within(e.segments), o) for e, o in zip(estimates, offsets, strict=True)]
    return Trajectory(
        np.concatenate([t.times + offset for t, offset in parts]),
        np.concatenate([t.positions for t, _ in parts]),
        np.concatenate([t.quats_xyzw for t, _ in parts]),
    )


def in_turn(
    sources: Sequence[MapSource], counts: dict[str, int]
) -> Generator[MapChunk, None, None]:
    """Yield the points of all runs, with times and numbers as if the runs had followed each other."""
    offsets = follow_each_other([source.estimate for source in sources])
    total: Counter[str] = Counter()
    for number, (source, offset) in enumerate(zip(sources, offsets, strict=True)):
        own: dict[str, int] = {}
        for chunk in source.chunks(own):
            run_id = np.full(len(chunk), number, np.uint16)
            times = chunk.times + offset if offset else chunk.times
            yield replace(chunk, times=times, run_id=run_id)
        total.update(own)
    counts.update(total)


def _open(path: Path, settings: MapSettings, origin_ns: int, placed: Placed | None) -> MapWriter:
    return open_map(
        path, settings.map_format, origin_ns, None if placed is None else placed.crs_wkt
    )


def _projected(points: NDArray[np.float64], placed: Placed | None) -> NDArray[np.float64]:
    return points if placed is None else placed.to_projected(points)
