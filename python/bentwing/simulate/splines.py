# SPDX-License-Identifier: MIT OR Apache-2.0
"""Uniform quintic B-splines: four times continuously differentiable, derivatives exact."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb, factorial
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

DEGREE = 5


def _basis() -> NDArray[np.float64]:
    """Coefficients of the basis: `B_m(u) = Σ_k basis[k, m] u^k`, for 0 ≤ u < 1."""
    basis = np.zeros((DEGREE + 1, DEGREE + 1))
    for m in range(DEGREE + 1):
        for s in range(DEGREE + 1 - m):
            sign = (-1) ** s * comb(DEGREE + 1, s)
            for k in range(DEGREE + 1):
                basis[k, m] += sign * comb(DEGREE, k) * float(DEGREE - m - s) ** (DEGREE - k)
    return basis / factorial(DEGREE)


_BASIS = _basis()


@dataclass(frozen=True, slots=True)
class Spline:
    """A smooth function of time that follows its control points.

    It stays inside the hull of six neighbouring control points and is constant where those
    are equal, so a carrier at rest does not move at all.

    Attributes
    ----------
    step : s, spacing of the control points; the first belongs to time 0
    controls : (K, D) float64
    """

    step: float
    controls: NDArray[np.float64]

    def __call__(self, times: NDArray[np.float64], derivative: int = 0) -> NDArray[np.float64]:
        """Values or derivatives at `times` (N,), as (N, D); the ends continue as constants."""
        position = np.asarray(times, dtype=np.float64) / self.step
        first = np.floor(position).astype(np.int64)
        weights = self._weights(position - first, derivative)
        last = len(self.controls) - 1
        values = np.zeros((len(position), self.controls.shape[1]))
        for m in range(DEGREE + 1):
            index = np.clip(first + m - DEGREE // 2, 0, last)
            values += weights[:, m, None] * self.controls[index]
        return values

    def _weights(self, u: NDArray[np.float64], derivative: int) -> NDArray[np.float64]:
        powers = np.zeros((len(u), DEGREE + 1))
        for k in range(derivative, DEGREE + 1):
            powers[:, k] = factorial(k) / factorial(k - derivative) * u ** (k - derivative)
        weights: NDArray[np.float64] = powers @ _BASIS / self.step**derivative
        return weights


def knot_times(step: float, duration: float) -> NDArray[np.float64]:
    """Return times of the control points of a spline over 0 … `duration`, with a margin at the end."""
    return np.arange(float(np.ceil(duration / step) + DEGREE)) * step
