# SPDX-License-Identifier: MIT OR Apache-2.0
"""Put consecutive sweeps, which may overlap in time, into one non-decreasing stream of points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.batches import LidarBatch

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Sequence

MAX_HELD = 0.3  # s of points held back for a sweep that begins before the last one has ended


class SweepMerger:
    """Hold the newest points back until it is known that no earlier ones follow.

    Parameters
    ----------
    counts : receives `late_points`, those earlier than what was handed out before
    """

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts
        self._held: LidarBatch | None = None
        self._released = -np.inf

    def push(self, sweeps: Sequence[LidarBatch]) -> LidarBatch | None:
        """Take the next sweeps; return the points that are complete, sorted in time."""
        sweeps = [sweep for sweep in sweeps if len(sweep.times)]
        if not sweeps:
            return None
        # Sweeps to come begin no earlier than the newest of these, which all devices keep.
        newest = float(sweeps[-1].times.min())
        held = [] if self._held is None else [self._held]
        merged = self._without_late(_merged([*held, *sweeps]))
        if not len(merged.times):
            return None
        limit = max(newest, float(merged.times[-1]) - MAX_HELD)
        n_complete = int(np.searchsorted(merged.times, limit, side="left"))
        self._held = merged.where(slice(n_complete, None))
        return self._release(merged.where(slice(None, n_complete)))

    def finish(self) -> LidarBatch | None:
        """Return what is still held."""
        held, self._held = self._held, None
        return None if held is None else self._release(held)

    def _release(self, batch: LidarBatch) -> LidarBatch | None:
        if not len(batch.times):
            return None
        self._released = float(batch.times[-1])
        return batch

    def _without_late(self, batch: LidarBatch) -> LidarBatch:
        n_late = int(np.searchsorted(batch.times, self._released, side="left"))
        self._counts["late_points"] += n_late
        return batch.where(slice(n_late, None)) if n_late else batch


def _merged(batches: Sequence[LidarBatch]) -> LidarBatch:
    """Join sweeps in time order; of equal times the earlier sweep's come first."""
    joined = batches[0] if len(batches) == 1 else LidarBatch.joined(batches)
    drops = np.flatnonzero(joined.times[1:] < joined.times[:-1])
    if not len(drops):
        return joined
    if len(batches) == 1:
        return joined.where(np.argsort(joined.times, kind="stable"))
    # Sweeps overlap at their ends: what lies before and after that is in order, and stays.
    before, after = np.split(joined.times, [drops[0] + 1])
    begin = int(np.searchsorted(before, after.min(), side="right"))
    before, after = np.split(joined.times, [drops[-1] + 1])
    end = len(before) + int(np.searchsorted(after, before.max(), side="left"))
    order = begin + np.argsort(joined.times[begin:end], kind="stable")
    fields = (joined.points, joined.times, joined.intensity, joined.ring, joined.attributes)
    for field in fields:
        if field is not None:
            field[begin:end] = field[order]
    return joined
