# SPDX-License-Identifier: MIT OR Apache-2.0
"""All that a finished map has of its points, chunk by chunk, in coordinates relative to its origin."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.map.chunk import MapChunk, untimed
from bentwing.map.read_chunks import CHUNK_SUFFIXES, MapFile

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bentwing.products.finished_map import FinishedMap


def chunks_of(source: FinishedMap) -> Iterator[MapChunk]:
    """Read a map; of PLY, PCD and E57 files only coordinates and times are read.

    Raises
    ------
    InputError
        If the file is damaged, which may show at its end only.
    """
    if source.path.suffix in CHUNK_SUFFIXES:
        for chunk in MapFile.open(source.path).chunks(source.run.start_ns):
            yield replace(chunk, points=chunk.points - source.origin)
        return
    for part in source.parts():
        chunk = untimed(part.points)
        times = np.full(len(part.points), np.nan) if part.times is None else part.times
        yield replace(chunk, times=times)
