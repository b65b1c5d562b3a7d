# SPDX-License-Identifier: MIT OR Apache-2.0
"""When the surroundings leave a direction of motion unseen, and what is said about it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.spans import name_spans, spans_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.base.spans import Span
    from bentwing.base.window_record import WindowRecord

# A sweep is degenerate when it says so much less, as a share of all, about its translation or its
# rotation in one direction: the surfaces it sees could be shifted or turned along themselves.
LEAST_SHARE = 5e-4
FEW = 0.02
"""More of the sweeps than this are worth a sentence."""
# Steeper than 60°, and flatter than 30°: the vertical component of a direction.
_STEEP, _FLAT = 0.87, 0.5


def is_degenerate(translation: Sequence[float], rotation: Sequence[float]) -> bool:
    """Whether shares of information (3,), increasing, leave a direction unseen."""
    return min(translation[0], rotation[0]) < LEAST_SHARE


def unseen_sentences(
    windows: Sequence[WindowRecord], *, has_imu: bool, since: float = 0.0
) -> list[str]:
    """Say when windows, sweeps or scans leave a direction unseen, if any do that end after `since`, s."""
    unseen = [w for w in windows if w.degenerate and w.time > since]
    spans = spans_of((w.time, w.degenerate and w.time > since) for w in windows)
    return [unseen_sentence(spans, has_imu=has_imu, where=_where(unseen))] if unseen else []


def unseen_sentence(
    spans: Sequence[Span], *, has_imu: bool, where: str = "in some direction"
) -> str:
    """Say when the surroundings leave a direction unseen, and what that means."""
    return f"{name_spans(spans)} the surroundings show too little structure {where}: {drift(has_imu=has_imu)}"


def drift(*, has_imu: bool) -> str:
    """Say what the trajectory is without the lidar."""
    carried = (
        "the IMU alone carries the position"
        if has_imu
        else "the motion is taken to go on as before"
    )
    return f"{carried} there, which drifts; compare the map before and after"


def _where(windows: Sequence[WindowRecord]) -> str:
    """Name the direction in which all of the windows see least, if they agree."""
    steepness = [
        abs(w.weakest_direction[2])
        for w in windows
        if w.weakest_direction is not None and _is_translation(w)
    ]
    if len(steepness) == len(windows):
        if min(steepness) > _STEEP:
            return "to tell the height"
        if max(steepness) < _FLAT:
            return "along a horizontal direction"
    return "in some direction"


def _is_translation(window: WindowRecord) -> bool:
    shift, turn = window.translation_eigenvalues, window.rotation_eigenvalues
    return bool(np.min(shift or 0.0) <= np.min(turn or 0.0))
