# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a map says about its points when all are known: surfaces, mixed pixels and what moved."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from bentwing import _core
from bentwing.base.array_spool import ArraySpool, columns_of
from bentwing.base.settings import Settings
from bentwing.map.chunk import MapChunk, beams_of

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable
    from pathlib import Path

    from numpy.typing import NDArray


EDGE = 0.2  # m; a cell holds a piece of a wall, and not two of them
MAX_CELLS = 1_500_000  # about 300 bytes each while beams are followed
N_STEPS = 256  # of time, in the cells
MIN_STEP = 0.5  # s; within it a spinning lidar looks everywhere about once
RAYS_PER_SECOND = 15_000
MAX_RAYS = 4_000_000  # 32 bytes each
# A beam that ends closer to a surface may have been stopped by it, had the trajectory been exact.
MARGIN = 2 * EDGE


class CleanSettings(Settings):
    """What is left out of the map."""

    mixed_pixels: bool = Field(
        default=True,
        description="leave out returns between two surfaces, where nothing else was seen; turn off to "
        "keep single twigs and wires",
    )
    moving: bool = Field(
        default=True,
        description="leave out what beams went through at other times: people, vehicles; turn off "
        "where nothing can have moved, as in a mine without people",
    )


def clean(
    chunks: Iterable[MapChunk],
    folder: Path,
    *,
    duration: float,
    settings: CleanSettings | None = None,
    counts: dict[str, int] | None = None,
    record: dict[str, Any] | None = None,
    threads: int | None = None,
) -> Generator[MapChunk, None, None]:
    """Give every point its incidence and local thickness, and leave out what is not there.

    All chunks pass once before the first one comes out; meanwhile they are on the disk.

    Parameters
    ----------
    chunks : as `project` yields them
    folder : of the temporary file, about 60 bytes per point
    duration : s, about how long the recording is
    settings : what is left out; default: all that the settings name
    counts : receives `map.mixed_pixels` and `map.moving`, the points left out
    record : receives `cell_edge`, `cells`, `moving_cells` and `beams_followed`
    threads : default: all cores

    Yields
    ------
    The chunks with `incidence` and `thickness`, without what is left out.
    """
    settings = settings or CleanSettings()
    counts = {} if counts is None else counts
    n_threads = threads or 0
    for name in ("map.mixed_pixels", "map.moving"):
        counts.setdefault(name, 0)
    survey: _core.MapSurvey | None = None
    with ArraySpool(folder) as spool:
        for chunk in chunks:
            survey = survey or _survey(chunk, duration)
            survey.add(
                chunk.points,
                beams=beams_of(chunk),
                ranges=chunk.ranges,
                times=chunk.times,
                doubtful=_doubtful(chunk),
                threads=n_threads,
            )
            spool.add(columns_of(chunk))
        if survey is None:
            return
        cells = survey.finish(threads=n_threads)
        if record is not None:
            record["cell_edge"], record["cells"] = cells.edge, cells.n_cells
            record["moving_cells"], record["beams_followed"] = cells.n_moving, cells.n_rays
        for columns in spool.tables():
            yield _cleaned(MapChunk(**columns), cells, settings, counts, n_threads)


def _survey(first: MapChunk, duration: float) -> _core.MapSurvey:
    return _core.MapSurvey(
        edge=EDGE,
        max_cells=MAX_CELLS,
        start=float(first.times[0]),
        step=max(MIN_STEP, duration / N_STEPS),
        max_rays=int(min(MAX_RAYS, max(RAYS_PER_SECOND * duration, 1.0))),
        margin=MARGIN,
    )


def _cleaned(
    chunk: MapChunk,
    cells: _core.MapCells,
    settings: CleanSettings,
    counts: dict[str, int],
    threads: int,
) -> MapChunk:
    incidence, thickness, moved, supported = cells.describe(
        chunk.points, beams=beams_of(chunk), threads=threads
    )
    chunk = replace(chunk, incidence=incidence, thickness=thickness)
    mixed = _doubtful(chunk) & ~supported if settings.mixed_pixels else np.zeros_like(moved)
    moved = moved & ~mixed if settings.moving else np.zeros_like(moved)
    counts["map.mixed_pixels"] += int(np.count_nonzero(mixed))
    counts["map.moving"] += int(np.count_nonzero(moved))
    gone = mixed | moved
    return chunk.where(~gone) if gone.any() else chunk


def _doubtful(chunk: MapChunk) -> NDArray[np.bool_]:
    return np.zeros(len(chunk), np.bool_) if chunk.doubtful is None else chunk.doubtful
