# SPDX-License-Identifier: MIT OR Apache-2.0
"""Stretches of the way on which the surroundings left a direction of motion unseen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray


def degenerate(
    times: NDArray[np.float64], windows: Sequence[Mapping[str, Any]]
) -> NDArray[np.bool_]:
    """Tell which times (N,), s, lie in the new part of a window that left a direction unseen."""
    ends = np.array([float(w["time"]) for w in windows])
    flags = np.array([bool(w.get("degenerate")) for w in windows] + [False])
    return np.asarray(flags[np.searchsorted(ends, times)])


def degenerate_spans(windows: Sequence[Mapping[str, Any]]) -> list[tuple[float, float]]:
    """First and last time, s, of each stretch of such windows."""
    spans: list[tuple[float, float]] = []
    before = 0.0
    for window in windows:
        end = float(window["time"])
        if window.get("degenerate"):
            first = spans.pop()[0] if spans and spans[-1][1] == before else before
            spans.append((first, end))
        before = end
    return spans


def spans_sentence(spans: Sequence[tuple[float, float]]) -> str:
    """Say where they are, for a caption."""
    if not spans:
        return "Every direction of motion was seen all the time."
    total = sum(last - first for first, last in spans)
    first = ", ".join(f"{a:.0f} to {b:.0f} s" for a, b in spans[:5])
    more = f" and {len(spans) - 5} more stretches" if len(spans) > 5 else ""
    return (
        f"Red: for {total:.0f} s the surroundings left a direction of motion unseen ({first}{more}); "
        "inertial data and smoothness carried it there."
    )
