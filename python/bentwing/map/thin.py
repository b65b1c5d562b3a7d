# SPDX-License-Identifier: MIT OR Apache-2.0
"""At most one point per voxel, on a stream and in bounded memory."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.base.voxels import VoxelSet, voxel_keys

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from bentwing.map.chunk import MapChunk


def thin(
    chunks: Iterable[MapChunk], spacing: float, counts: dict[str, int] | None = None
) -> Iterator[MapChunk]:
    """Keep the first point in every voxel of `spacing` metres; 0 keeps all points.

    All points are the default of a map, because one point per voxel smaller than a few times the
    range noise flattens the distribution of the noise and makes walls look thicker than measured.

    Parameters
    ----------
    chunks : stream of map chunks
    spacing : m, edge of the voxels
    counts : receives `map.thinned`, the points left out

    Raises
    ------
    UsageError
        If the spacing is negative or not finite.
    """
    if not (np.isfinite(spacing) and spacing >= 0):
        msg = (
            f"map spacing {spacing} m cannot be used; give a length in metres, or 0 for all points"
        )
        raise UsageError(msg)
    return _thinned(chunks, spacing, {} if counts is None else counts)


def _thinned(
    chunks: Iterable[MapChunk], spacing: float, counts: dict[str, int]
) -> Iterator[MapChunk]:
    counts.setdefault("map.thinned", 0)
    seen = VoxelSet()
    for chunk in chunks:
        keep = seen.add(voxel_keys(chunk.points, spacing)) if spacing else slice(None)
        kept = chunk.where(keep)
        counts["map.thinned"] += len(chunk) - len(kept)
        if len(kept):
            yield kept
