# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the passes of the filter say, as an `Estimate`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.base.covariances import PoseCovariances
from bentwing.base.estimate import Estimate
from bentwing.base.spans import name_spans, spans_of
from bentwing.odometry.health import FEW, drift, unseen_sentence
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
    whole = joined(parts)
    # One latency for all of it: where the lidar's clock drifts, it is that of the middle.
    middle = 0.5 * float(whole.times[0] + whole.times[-1])
    return Estimate(
        whole,
        passes[-1].calibration.with_epoch(middle),
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
        covariances=PoseCovariances.joined(
            [p.covariances(t) for p, t in zip((p for p in passes if p.windows), parts, strict=True)]
        ),
    )


def _health(windows: Sequence[WindowRecord], blind: float) -> list[str]:
    sentences = []
    # The first sweep makes the map.
    lost = [(w.time, not w.registered and w is not windows[0]) for w in windows]
    if sum(is_lost for _, is_lost in lost) > FEW * len(windows):
        sentences.append(
            f"{name_spans(spans_of(lost))} too little is seen of what was seen before: "
            f"{drift(has_imu=True)}"
        )
    start, stop = _longest_weakness(windows)
    if stop - start > WEAK:
        sentences.append(unseen_sentence([(start, stop)], has_imu=True))
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
