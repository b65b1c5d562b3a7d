# SPDX-License-Identifier: MIT OR Apache-2.0
"""Robust fits: weights that outliers do not bend."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

MAD_TO_STD = 1.4826  # of a normal distribution
_TUKEY = 4.685  # 95 % efficient on normal noise
_ITERATIONS = 50
_CONVERGED = 1e-10


@dataclass(frozen=True, slots=True)
class Line:
    """`y = slope x + intercept`."""

    slope: float
    intercept: float


def scale(residuals: NDArray[np.float64]) -> float:
    """Return the standard deviation of residuals about zero, from their median size."""
    return MAD_TO_STD * float(np.median(np.abs(residuals)))


def tukey(residuals: NDArray[np.float64], sigma: float) -> NDArray[np.float64]:
    """Tukey's biweight: 1 at zero, 0 beyond 4.685 sigma."""
    share = np.minimum(np.abs(residuals) / (_TUKEY * max(sigma, 1e-300)), 1.0)
    weights: NDArray[np.float64] = (1 - share**2) ** 2
    return weights


def cauchy(residuals: NDArray[np.float64], sigma: float) -> NDArray[np.float64]:
    """Cauchy's weight: never zero, so that a poor start can still be left."""
    weights: NDArray[np.float64] = 1 / (1 + (residuals / max(sigma, 1e-300)) ** 2)
    return weights


def fit_line(x: NDArray[np.float64], y: NDArray[np.float64]) -> Line | None:
    """Fit a line by iteratively reweighted least squares; None where x does not vary.

    References
    ----------
    Kaul 2015, figure 20: robust least squares regression; here with Tukey's weights.
    """
    if len(x) < 3 or np.ptp(x) < 1e-9:
        return None
    columns = np.stack([x, np.ones_like(x)], axis=1)
    found = np.linalg.lstsq(columns, y, rcond=None)[0]
    for _ in range(_ITERATIONS):
        residuals = y - columns @ found
        root = np.sqrt(tukey(residuals, scale(residuals)))
        if np.count_nonzero(root) < 3:
            break  # more than half of the points lie on the line
        before = found
        found = np.linalg.lstsq(columns * root[:, None], y * root, rcond=None)[0]
        if np.abs(found - before).max() < _CONVERGED:
            break
    return Line(float(found[0]), float(found[1]))
