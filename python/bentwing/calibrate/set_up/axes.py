# SPDX-License-Identifier: MIT OR Apache-2.0
"""Signed axes: the 48 ways in which a driver can name and point the axes of a sensor."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, cast

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bentwing.recording.sections.imu import Axes


def signed_permutations() -> Iterator[NDArray[np.float64]]:
    """Yield the matrices (3, 3) of all axes; the samples as they are come first."""
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            yield matrix


def nearest(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the signed axes (3, 3) that an orthogonal matrix (3, 3) is closest to."""
    return max(signed_permutations(), key=lambda axes: float((axes * matrix).sum()))


def angle_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Return the angle between orthogonal matrices (3, 3), rad; π if one of them is mirrored."""
    between = a.T @ b
    if np.linalg.det(between) < 0.0:
        return float(np.pi)
    return float(np.arccos(np.clip((np.trace(between) - 1.0) / 2.0, -1.0, 1.0)))


def named(axes: NDArray[np.float64]) -> Axes:
    """Return axes (3, 3) as payload.yaml has them: which axis of the samples each one is."""
    names = [("-" if row.sum() < 0 else "") + "xyz"[int(np.argmax(np.abs(row)))] for row in axes]
    return cast("Axes", tuple(names))


def of(axes: Axes) -> NDArray[np.float64]:
    """Return named axes as a matrix (3, 3) that takes the samples to the imu frame."""
    matrix = np.zeros((3, 3))
    for row, axis in zip(matrix, axes, strict=True):
        row["xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    return matrix
