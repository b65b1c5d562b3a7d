# SPDX-License-Identifier: MIT OR Apache-2.0
"""Rigid transforms as 4 × 4 matrices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry

if TYPE_CHECKING:
    from numpy.typing import NDArray


def rigid(R: NDArray[np.float64], t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Put rotations (..., 3, 3) and translations (..., 3) together to transforms (..., 4, 4)."""
    T = np.zeros((*np.shape(R)[:-2], 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, t, 1.0
    return T


def from_poses(positions: NDArray[np.float64], quats: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the transforms (..., 4, 4) of positions (..., 3) and quaternions (..., 4)."""
    return rigid(geometry.to_matrices(quats), positions)


def upright(yaw: float, shift: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn by `yaw` (rad) about the vertical, then shift by (3,) m."""
    T = np.eye(4)
    T[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    T[:3, 3] = shift
    return T


def apply(T: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Transform points (N, 3)."""
    moved: NDArray[np.float64] = points @ T[:3, :3].T + T[:3, 3]
    return moved


def inverse(T: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the inverse of a rigid transform."""
    R, t = T[:3, :3], T[:3, 3]
    return rigid(R.T, -R.T @ t)


def turned_and_shifted(
    T: NDArray[np.float64], tangent: NDArray[np.float64], about: NDArray[np.float64]
) -> NDArray[np.float64]:
    """`T` perturbed on the left by (6,) rotation first, the rotation being about a point (3,)."""
    R = geometry.to_matrices(geometry.exp(tangent[:3]))
    return rigid(R @ T[:3, :3], R @ (T[:3, 3] - about) + about + tangent[3:])
