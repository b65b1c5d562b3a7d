# SPDX-License-Identifier: MIT OR Apache-2.0
"""Rotations about the axis of a motor, which nothing can tell from its zero."""

from __future__ import annotations

import numpy as np


def about_axis(quat_xyzw: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """The part of a rotation that turns about `axis` (its twist)."""
    twist = np.append(axis * (quat_xyzw[:3] @ axis), quat_xyzw[3])
    return twist / np.linalg.norm(twist)
