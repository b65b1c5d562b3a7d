# SPDX-License-Identifier: MIT OR Apache-2.0
"""What became of flights: how long the rate was in the planned range, and how long it stalled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.odometry.stall import LOST_AFTER, STALLED
from bentwing.simulate.plant.flights import CONTROL_STEP

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.plant.flights import Flown

SPIN_UP = 10.0
"""s from the start of the rotors; a map begins after it."""


@dataclass(frozen=True, slots=True)
class Outcomes:
    """Of N flights; rates in rad/s.

    Attributes
    ----------
    in_range : share of all the time in the range
    percentiles : 1, 50 and 99 % of the rates
    longest_stalls : (N,) s
    """

    in_range: float
    percentiles: tuple[float, float, float]
    longest_stalls: NDArray[np.float64]

    @property
    def kept(self) -> float:
        """Share of flights without a stall too long for the map."""
        return float(np.mean(self.longest_stalls <= LOST_AFTER))


def outcomes(flown: Flown, lowest: float, highest: float) -> Outcomes:
    """Judge flights by the range of rates `lowest` to `highest`, rad/s, from `SPIN_UP` on."""
    first = int(np.searchsorted(flown.times, SPIN_UP))
    rates = flown.rates[first:]
    in_range = float(np.mean((rates >= lowest) & (rates <= highest)))
    low, middle, high = np.percentile(rates, [1.0, 50.0, 99.0]).tolist()
    stalled = np.abs(rates) < STALLED * flown.desired[first:]
    longest = CONTROL_STEP * _longest_runs(stalled).astype(np.float64)
    return Outcomes(in_range, (low, middle, high), longest)


def _longest_runs(flags: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Length of the longest run of True in each column of (K, N)."""
    run = np.zeros(flags.shape[1], np.int64)
    longest = run.copy()
    for row in flags:
        run = np.where(row, run + 1, 0)
        np.maximum(longest, run, out=longest)
    return longest
