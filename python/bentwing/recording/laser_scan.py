# SPDX-License-Identifier: MIT OR Apache-2.0
"""Scans of a 2D lidar → points in its scan plane (z = 0) with a time per beam."""

from __future__ import annotations

import functools
import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.batches import LidarBatch

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.recording.wire_scans import RawScan

MAX_SWEEP = 10.0  # s; a longer scan is a damaged time_increment


def has_beam_times(scan: RawScan) -> bool:
    """Whether the time of each beam is known: `stamp + i * time_increment`."""
    return scan.time_increment != 0.0 or len(scan.ranges) < 2


def is_sane(scan: RawScan) -> bool:
    """Whether angles and times can be computed with; damaged messages fail here."""
    numbers = (scan.angle_min, scan.angle_increment, scan.time_increment)
    duration = abs(scan.time_increment) * len(scan.ranges)
    return all(map(math.isfinite, numbers)) and duration < MAX_SWEEP


def points_of_scans(
    scans: Sequence[RawScan], starts: NDArray[np.float64], counts: Counter[str]
) -> list[LidarBatch]:
    """Return the valid returns of consecutive scans, one batch per run of equal geometry.

    Parameters
    ----------
    scans : all `is_sane`
    starts : (S,) s, time of each scan's first beam
    counts : receives `returns` (all beams), `nan`, `inf`, `zero`, `out_of_range`
    """
    batches = []
    pairs = zip(scans, starts.tolist(), strict=True)
    for _, run in itertools.groupby(pairs, key=lambda pair: _geometry(pair[0])):
        members, times = zip(*run, strict=True)
        batches.append(_points_of_run(members, np.array(times), counts))
    return batches


def _geometry(scan: RawScan) -> tuple[float | int | bool, ...]:
    return (*scan[1:4], *scan[5:7], len(scan.ranges), scan.intensities is None)


def _points_of_run(
    scans: Sequence[RawScan], starts: NDArray[np.float64], counts: Counter[str]
) -> LidarBatch:
    head = scans[0]
    ranges = np.stack([scan.ranges for scan in scans]).astype(np.float64)
    keep = _valid(ranges, head.range_min, head.range_max, counts)
    rays = _rays(head.angle_min, head.angle_increment, len(head.ranges))
    times = starts[:, None] + np.arange(len(head.ranges)) * head.time_increment
    distances = ranges[keep]
    beams = np.broadcast_to(np.arange(len(head.ranges)), ranges.shape)[keep]
    points = rays[beams] * distances[:, None]
    intensity = None
    if head.intensities is not None:
        stacked = [scan.intensities for scan in scans if scan.intensities is not None]
        intensity = np.stack(stacked).astype(np.float32)[keep]
    return LidarBatch(points, times[keep], intensity)


def _valid(
    ranges: NDArray[np.float64], low: float, high: float, counts: Counter[str]
) -> NDArray[np.bool_]:
    """Return which ranges are returns, and count why the others are not."""
    is_nan, is_inf, is_zero = np.isnan(ranges), np.isinf(ranges), ranges == 0.0
    # Some drivers leave the limits at zero; NaN limits compare false and keep nothing.
    within = (ranges >= low) & (ranges <= high) if high > 0 else ranges > 0
    counts["returns"] += ranges.size
    counts["nan"] += int(is_nan.sum())
    counts["inf"] += int(is_inf.sum())
    counts["zero"] += int(is_zero.sum())
    keep = within & ~is_nan & ~is_inf & ~is_zero
    counts["out_of_range"] += int((~keep & ~is_nan & ~is_inf & ~is_zero).sum())
    return np.asarray(keep, dtype=np.bool_)


@functools.lru_cache(maxsize=8)
def _rays(angle_min: float, increment: float, n: int) -> NDArray[np.float64]:
    """(n, 3) unit vectors of the beams, lidar frame."""
    angles = angle_min + np.arange(n) * increment
    return np.column_stack([np.cos(angles), np.sin(angles), np.zeros(n)])
