# SPDX-License-Identifier: MIT OR Apache-2.0
"""Stretches of the way on which the surroundings left a direction of motion unseen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.spans import spans_of
from bentwing.report.sections import named_spans

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bentwing.report.texts import Texts


def degenerate(
    times: NDArray[np.float64], windows: Sequence[Mapping[str, Any]]
) -> NDArray[np.bool_]:
    """Tell which times (N,), s, lie in the new part of a window that left a direction unseen."""
    ends = np.array([float(w["time"]) for w in windows])
    flags = np.array([bool(w.get("degenerate")) for w in windows] + [False])
    return np.asarray(flags[np.searchsorted(ends, times)])


def degenerate_spans(windows: Sequence[Mapping[str, Any]]) -> list[tuple[float, float]]:
    """First and last time, s, of each stretch of such windows."""
    return spans_of((float(w["time"]), bool(w.get("degenerate"))) for w in windows)


def spans_sentence(spans: Sequence[tuple[float, float]], texts: Texts) -> str:
    """Say where they are, for a caption."""
    if not spans:
        return texts.seen_all
    total = sum(last - first for first, last in spans)
    return texts.say(texts.seen_not, total=total, spans=named_spans(spans, texts))
