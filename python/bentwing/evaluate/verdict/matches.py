# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether what the lidar sees fits what it has seen, by the records of windows, sweeps or scans."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.spans import spans_of
from bentwing.evaluate.verdict.evidence import Evidence
from bentwing.evaluate.verdict.stretches import over_time
from bentwing.evaluate.verdict.usual import usual_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.window_record import WindowRecord

# Until the head has turned and surfaces are old enough to be seen again there is little to match, s.
SETTLING = 4.0
# Fewer matches tell nothing of where the lidar is; good windows have thousands, sweeps hundreds.
FEWEST = 30
# So little of what windows see tells the position in one direction.
_BLIND = 0.01
# A record speaks for no more than this, s, however long the recording was silent before.
_LONGEST = 1.5


def judge_matches(windows: Sequence[WindowRecord]) -> list[Evidence]:
    """Judge by how many surfaces are seen again, and by how many of these agree."""
    if not windows:
        return []
    settled = [w for w in windows if w.time > windows[0].time + SETTLING]
    if not settled:
        return []
    times = np.array([w.time for w in settled])
    before = np.append(times[0] - _LONGEST, times[:-1])
    seconds = np.clip(times - before, 1e-3, _LONGEST)
    lost = np.array([_is_lost(w) for w in settled])
    spans = tuple(spans_of((w.time, bool(_is_lost(w))) for w in settled))
    share = float(seconds[lost].sum() / seconds.sum())
    found = [Evidence("lost", share, spans, {"seconds": float(seconds[lost].sum())})]
    return [*found, *_agreement(settled, ~lost, seconds), *_unseen(settled, seconds)]


def _is_lost(window: WindowRecord) -> bool:
    if window.registered is not None:
        return not window.registered
    return _n_matches(window) < FEWEST


def _n_matches(window: WindowRecord) -> int:
    return window.n_matches + (window.n_fixed_matches or 0) + (window.n_line_matches or 0)


def _agreement(
    windows: Sequence[WindowRecord], matched: NDArray[np.bool_], seconds: NDArray[np.float64]
) -> list[Evidence]:
    known = [
        (w.time, 1.0 - w.inlier_share, s)
        for w, m, s in zip(windows, matched, seconds, strict=True)
        if m and w.inlier_share is not None
    ]
    if not known:
        return []
    times, outliers, weights = np.array(known).T
    usual = usual_of(windows).outliers
    found = over_time(times, outliers, weights)
    spans = found.spans_over("matches", lambda share: share / usual)
    return [Evidence("matches", found.high / usual, spans, {"share": 100 * found.high})]


def _unseen(windows: Sequence[WindowRecord], seconds: NDArray[np.float64]) -> list[Evidence]:
    """Judge by the longest time, s, in which windows leave a direction of the position unseen."""
    longest = now = 0.0
    for window, length in zip(windows, seconds.tolist(), strict=True):
        seen = window.translation_eigenvalues
        is_blind = window.registered is None and seen is not None and min(seen) < _BLIND
        now = now + length if is_blind else 0.0
        longest = max(longest, now)
    return [Evidence("unseen", longest)]
