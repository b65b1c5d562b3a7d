# SPDX-License-Identifier: MIT OR Apache-2.0
"""Columns of a scan's table as the arrays that most engines want."""

from __future__ import annotations

import numpy as np


def returns(scan: np.ndarray) -> np.ndarray:
    """The table without shots that brought nothing back."""
    return scan[(scan["x"] != 0) | (scan["y"] != 0) | (scan["z"] != 0)]


def xyz_of(scan: np.ndarray) -> np.ndarray:
    """Returns (N, 3) float64, m."""
    scan = returns(scan)
    return np.stack([scan["x"], scan["y"], scan["z"]], axis=1).astype(np.float64)


def stamps_of(scan: np.ndarray, start_ns: int) -> np.ndarray:
    """When they were measured (N,) int64, ns."""
    return start_ns + returns(scan)["t"].astype(np.int64)
