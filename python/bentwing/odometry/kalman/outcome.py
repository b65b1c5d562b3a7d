# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the passes of the filter say, as an `Estimate`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.base.estimate import Estimate
from bentwing.odometry.health import FEW
from bentwing.odometry.segments import joined

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.base.breaks import Break
    from bentwing.base.window_record import WindowRecord
    from bentwing.odometry.kalman.snapshot import FilterSnapshot

# So long a weakness is, s: a lidar that turns looks elsewhere before.
WEAK = 3.0
# Seconds without inertial samples that are.
BLIND = 0.3


def estimate_of(
    passes: Sequence[FilterSnapshot], breaks: Sequence[Break], n_small: int
) -> Estimate:
    """Return what passes that follow each other say, level and from the origin on.

    Parameters
    ----------
    passes, breaks : between two passes the recording breaks
    n_small : sweeps with too few points
    """
    parts = [p.trajectory() for p in passes if p.windows]
    windows = [w for p in passes for w in p.windows]
    blind = sum(p.blind for p in passes)
    return Estimate(
        joined(parts),
        passes[-1].calibration,
        windows=windows,
        counts={
            "kalman.sweeps": len(windows),
            "kalman.sweeps_not_matched": sum(not w.registered for w in windows),
            "kalman.sweeps_too_small": n_small,
        },
        timings={"filter": sum(p.seconds for p in passes)},
        health=_health(windows, blind),
        breaks=[*breaks],
        segments=[(float(p.times[0]), float(p.times[-1])) for p in parts],
    )


def _health(windows: Sequence[WindowRecord], blind: float) -> list[str]:
    sentences = []
    # The first sweep makes the map.
    lost = [w.time for w in windows[1:] if not w.registered]
    if len(lost) > FEW * len(windows):
        sentences.append(
            f"{len(lost)} of {len(windows)} sweeps match too little of what was seen before (first "
            f"at {lost[0]:.1f} s): the IMU alone carries the estimate there"
        )
    start, stop = _longest_weakness(windows)
    if stop - start > WEAK:
        sentences.append(
            f"from {start:.1f} to {stop:.1f} s the sweeps see too little in some direction: the IMU "
            "carries the estimate there"
        )
    if blind > BLIND:
        sentences.append(f"{blind:.2f} s have no inertial data: the motion went on as before there")
    return sentences


def _longest_weakness(windows: Sequence[WindowRecord]) -> tuple[float, float]:
    """Return first and last time of the longest stretch of degenerate sweeps."""
    longest, since = (0.0, 0.0), None
    for w in windows:
        if not (w.registered and w.degenerate):
            since = None
            continue
        since = w.time if since is None else since
        if w.time - since > longest[1] - longest[0]:
            longest = since, w.time
    return longest
