# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether a trajectory is one that a carrier can fly, walk or drive, and where it breaks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.evaluate.verdict.evidence import Evidence

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.base.breaks import Break
    from bentwing.base.estimate import Estimate

# Poses so far apart tell a speed without vibration, s.
_STEP = 0.5


def judge_path(estimate: Estimate) -> list[Evidence]:
    """Judge by the greatest speed, m/s, within the segments."""
    fastest, at = 0.0, 0.0
    for first, last in estimate.spans:
        part = estimate.trajectory.within([(first, last)])
        if len(part.times) < 2:
            continue
        step = max(1, round(_STEP / float(part.times[1] - part.times[0])))
        times, positions = part.times[::step], part.positions[::step]
        speeds = np.linalg.norm(np.diff(positions, axis=0), axis=1) / np.maximum(
            np.diff(times), 1e-9
        )
        if len(speeds) and speeds.max() > fastest:
            fastest, at = float(speeds.max()), float(times[int(np.argmax(speeds))])
    return [Evidence("speed", fastest, (), {"at": at})]


def judge_breaks(breaks: Sequence[Break]) -> list[Evidence]:
    """Judge by how often the trajectory begins anew at a place that is a guess."""
    guessed = [b for b in breaks if b.outcome in {"guessed", "not found"}]
    spans = tuple((b.start, b.stop) for b in guessed)
    return [Evidence("breaks", float(len(guessed)), spans)]
