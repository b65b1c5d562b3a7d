# SPDX-License-Identifier: MIT OR Apache-2.0
"""A measure over time: what it is in the worst tenth, and when it is beyond a bound."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.spans import spans_of
from bentwing.evaluate.verdict.kinds import KINDS

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bentwing.base.spans import Span

    Array = NDArray[np.float64]

LENGTH = 5.0
"""s, of the stretches over which a measure is averaged: a blow is shorter, a fault is not."""
_WORST = 0.9


@dataclass(frozen=True, slots=True)
class OverTime:
    """Means of a measure over stretches.

    Attributes
    ----------
    ends : (K,) s
    values : (K,)
    """

    ends: Array
    values: Array

    @property
    def high(self) -> float:
        """What the measure exceeds in the worst tenth of the time."""
        return float(np.quantile(self.values, _WORST)) if len(self.values) else 0.0

    def spans_over(self, kind: str, scale: Callable[[Array], Array]) -> tuple[Span, ...]:
        """Return when the measure is beyond what is doubtful; nothing if it always is."""
        beyond = scale(self.values) > KINDS[kind].doubtful
        if beyond.all():
            return ()
        return tuple(spans_of(zip(self.ends.tolist(), beyond.tolist(), strict=True)))


def over_time(times: Array, values: Array, weights: Array | None = None) -> OverTime:
    """Average values (K,) at times (K,), s, over stretches of time."""
    weights = np.ones(len(values)) if weights is None else weights
    numbers = np.floor((times - times[0]) / LENGTH).astype(np.int64)
    # What is left at the end belongs to the stretch before it.
    n = max(1, round((times[-1] - times[0]) / LENGTH))
    numbers = np.minimum(numbers, n - 1)
    totals = np.bincount(numbers, weights, minlength=n)
    sums = np.bincount(numbers, weights * values, minlength=n)
    ends = times[0] + LENGTH * np.arange(1, n + 1, dtype=np.float64)
    ends[-1] = max(ends[-1], times[-1])
    seen = totals > 0
    return OverTime(ends[seen], sums[seen] / totals[seen])
