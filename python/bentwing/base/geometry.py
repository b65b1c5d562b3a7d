# SPDX-License-Identifier: MIT OR Apache-2.0
"""Rotations of whole arrays: quaternions, matrices, exponential map, interpolation.

Quaternions are Hamilton, stored x y z w, unit length; every function broadcasts over the leading
axes and expects the component axis last.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

IDENTITY_QUAT_XYZW = (0.0, 0.0, 0.0, 1.0)
_SMALL_ANGLE = 1e-6  # below it sin(x)/x is 1 to double precision after the quadratic term


def multiply(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Product of quaternions: `rotate(multiply(a, b), v) == rotate(a, rotate(b, v))`."""
    ax, ay, az, aw = np.moveaxis(a, -1, 0)
    bx, by, bz, bw = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
        axis=-1,
    )


def inverse(quats: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of unit quaternions."""
    conjugate: NDArray[np.float64] = quats * np.array([-1.0, -1.0, -1.0, 1.0])
    return conjugate


def rotate(quats: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotate vectors `(..., 3)` by unit quaternions `(..., 4)`."""
    x, y, z, w = np.moveaxis(quats, -1, 0)
    vx, vy, vz = np.moveaxis(vectors, -1, 0)
    # v + 2 w (q × v) + 2 q × (q × v), with c = 2 (q × v)
    cx, cy, cz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    rotated = np.empty((*np.broadcast_shapes(x.shape, vx.shape), 3))
    rotated[..., 0] = vx + w * cx + (y * cz - z * cy)
    rotated[..., 1] = vy + w * cy + (z * cx - x * cz)
    rotated[..., 2] = vz + w * cz + (x * cy - y * cx)
    return rotated


def to_matrices(quats: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation matrices `(..., 3, 3)` of unit quaternions."""
    columns = [rotate(quats, axis) for axis in np.eye(3)]
    return np.stack(columns, axis=-1)


def from_matrices(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn rotation matrices `(..., 3, 3)` into unit quaternions with w >= 0.

    The largest component comes from the diagonal and the others are divided by it, so that no
    angle, 180° included, loses precision.
    """
    m = np.asarray(matrices, dtype=np.float64)
    d = np.diagonal(m, axis1=-2, axis2=-1)
    trace = d.sum(axis=-1)
    # rows of 4 q qᵀ, one of which is far from zero
    k = np.empty((*m.shape[:-2], 4, 4))
    for i in range(3):
        k[..., i, i] = 1 + 2 * d[..., i] - trace
        k[..., i, 3] = k[..., 3, i] = (
            m[..., (i + 2) % 3, (i + 1) % 3] - m[..., (i + 1) % 3, (i + 2) % 3]
        )
        j = (i + 1) % 3
        k[..., i, j] = k[..., j, i] = m[..., i, j] + m[..., j, i]
    k[..., 3, 3] = 1 + trace
    largest = np.argmax(np.diagonal(k, axis1=-2, axis2=-1), axis=-1)
    quats = np.take_along_axis(k, largest[..., None, None], axis=-2)[..., 0, :]
    quats = quats / np.linalg.norm(quats, axis=-1, keepdims=True)
    return _positive(quats)


def from_rpy(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn roll, pitch and yaw `(..., 3)` in rad into unit quaternions with w >= 0.

    As in URDF: about the fixed axes x, then y, then z, so R = Rz(yaw) · Ry(pitch) · Rx(roll).
    """
    roll, pitch, yaw = (exp(angles[..., i, None] * np.eye(3)[i]) for i in range(3))
    return _positive(multiply(yaw, multiply(pitch, roll)))


def exp(rotation_vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions of rotation vectors `(..., 3)` in rad."""
    v = np.asarray(rotation_vectors, dtype=np.float64)
    half = 0.5 * np.linalg.norm(v, axis=-1, keepdims=True)
    return np.concatenate([0.5 * v * np.sinc(half / np.pi), np.cos(half)], axis=-1)


def log(quats: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation vectors `(..., 3)` in rad, of at most π, of unit quaternions."""
    q = _positive(quats)
    sine = np.linalg.norm(q[..., :3], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., 3:])
    small = sine < _SMALL_ANGLE
    vectors: NDArray[np.float64] = q[..., :3] * np.where(
        small, 2.0, angle / np.where(small, 1.0, sine)
    )
    return vectors


def slerp(
    start: NDArray[np.float64], end: NDArray[np.float64], shares: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Turn from `start` to `end` at constant rate, along the shorter way.

    Parameters
    ----------
    start, end : (..., 4) unit quaternions
    shares : (...,) 0 at `start`, 1 at `end`
    """
    cosine = np.einsum("...i,...i->...", start, end)
    sign = np.where(cosine < 0, -1.0, 1.0)
    half = np.arccos(np.minimum(np.abs(cosine), 1.0))
    straight = half < _SMALL_ANGLE
    sine = np.where(straight, 1.0, np.sin(half))
    a = np.where(straight, 1 - shares, np.sin((1 - shares) * half) / sine)
    b = np.where(straight, shares, np.sin(shares * half) / sine) * sign
    quats = a[..., None] * start + b[..., None] * end
    # arccos is imprecise near 1; the length takes what is left of it
    unit: NDArray[np.float64] = quats / np.linalg.norm(quats, axis=-1, keepdims=True)
    return unit


def mean_rotation(quats: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation `(4,)` that is nearest to all of `(N, 4)`, whatever the sign of each.

    References
    ----------
    Markley et al. 2007, Averaging quaternions: the eigenvector of Σ q qᵀ.
    """
    _, vectors = np.linalg.eigh(np.einsum("ni,nj->ij", quats, quats))
    mean = vectors[:, -1]
    return _positive(mean)


def compose(
    translation: NDArray[np.float64], quat: NDArray[np.float64], points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Coordinates of `points` in a, given the pose of b in a: `R p + t`."""
    return rotate(quat, points) + translation


def orthogonal_pair(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return two unit vectors (2, 3) that complete a unit vector to a right-handed frame, as the core does."""
    away = np.array([1.0, 0.0, 0.0] if abs(axis[0]) < 0.6 else [0.0, 1.0, 0.0])
    first = np.cross(axis, away)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first)])


def _positive(quats: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of the two quaternions of each rotation, the one with w >= 0."""
    return np.where(quats[..., 3:] < 0, -quats, quats)
