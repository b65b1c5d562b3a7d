# SPDX-License-Identifier: MIT OR Apache-2.0
"""Rotations that cover all there are, evenly."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Alexa, Super-Fibonacci spirals (CVPR 2022): the positive root of x⁴ = x + 4.
_PSI = 1.533751168755204288118041


def spread(n: int) -> NDArray[np.float64]:
    """Return n rotations (n, 3, 3), evenly spread over all there are."""
    from scipy.spatial.transform import Rotation

    s = np.arange(n) + 0.5
    inner, outer = np.sqrt(s / n), np.sqrt(1.0 - s / n)
    a, b = 2 * np.pi * s / np.sqrt(2.0), 2 * np.pi * s / _PSI
    quats = [inner * np.sin(a), inner * np.cos(a), outer * np.sin(b), outer * np.cos(b)]
    return np.asarray(Rotation.from_quat(np.column_stack(quats)).as_matrix())
