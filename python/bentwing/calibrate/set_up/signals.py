# SPDX-License-Identifier: MIT OR Apache-2.0
"""Means of sampled vectors about other times, as they are compared with those of another sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.trajectory import DT
from bentwing.calibrate.set_up.motion import LONG_HALF

if TYPE_CHECKING:
    from numpy.typing import NDArray

HIDDEN = round(LONG_HALF / DT)
"""Samples at both ends of which smoothed values say nothing."""


class Averages:
    """Averages of samples over short times.

    Parameters
    ----------
    times : (M,) s, increasing
    values : (M, 3)
    """

    def __init__(self, times: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        self._times = times
        steps = (values[1:] + values[:-1]) / 2 * np.diff(times)[:, None]
        self._integral = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])

    def about(self, times: NDArray[np.float64], half: float) -> NDArray[np.float64]:
        """Return the averages (N, 3) over `half` seconds on both sides of times (N,)."""
        return (self._at(times + half) - self._at(times - half)) / (2 * half)

    def covers(self, times: NDArray[np.float64], half: float) -> NDArray[np.bool_]:
        """Return at which times (N,) there are samples on both sides."""
        return np.asarray((times - half >= self._times[0]) & (times + half <= self._times[-1]))

    def _at(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.column_stack(
            [np.interp(times, self._times, column) for column in self._integral.T]
        )


def smoothed(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return averages (N - 2 HIDDEN, 3) of values (N, 3) at the trajectory's rate, weighted by a triangle.

    Second differences of positions over `LONG_HALF` are averages of accelerations with this weight.
    """
    triangle = 1.0 - np.abs(np.arange(-HIDDEN, HIDDEN + 1)) * DT / LONG_HALF
    kernel = triangle / triangle.sum()
    if len(values) < len(kernel):
        return np.empty((0, 3))
    return np.column_stack([np.convolve(column, kernel, "valid") for column in values.T])
