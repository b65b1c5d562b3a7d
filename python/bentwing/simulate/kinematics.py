# SPDX-License-Identifier: MIT OR Apache-2.0
"""Rigid motion with its exact derivatives, built joint by joint.

A `Motion` is that of a frame `b` in the map. Turning it about an axis or shifting it gives the
motion of the next frame of the chain, with velocity, acceleration and angular acceleration
carried along analytically: nothing here is differentiated numerically.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.splines import Spline

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion of a frame `b` at N instants.

    Attributes
    ----------
    R : (N, 3, 3), `R_map_b`
    p, v, a : (N, 3), m, m/s, m/s², of its origin, map frame
    omega, alpha : (N, 3), rad/s, rad/s², in b
    """

    R: Array
    p: Array
    v: Array
    a: Array
    omega: Array
    alpha: Array

    def turned(self, axis: Array, angle: Spline, times: Array) -> Motion:
        """Return the frame turned by `angle(times)` about the unit vector `axis` of this frame."""
        theta, rate, rate_dot = (angle(times, k)[:, 0] for k in range(3))
        R_b_c = rotation(axis * theta[:, None])
        omega = _into(R_b_c, self.omega)
        spin = axis * rate[:, None]
        # d/dt (R_cᵀ ω) = R_cᵀ α − spin × R_cᵀ ω
        alpha = _into(R_b_c, self.alpha) + axis * rate_dot[:, None] - np.cross(spin, omega)
        return Motion(self.R @ R_b_c, self.p, self.v, self.a, omega + spin, alpha)

    def mounted(self, R_b_c: Array, t_b_c: Array) -> Motion:
        """Return the motion of a frame c fixed in b by the constant `T_b_c`."""
        v_c = np.cross(self.omega, t_b_c)
        a_c = np.cross(self.alpha, t_b_c) + np.cross(self.omega, v_c)
        return Motion(
            self.R @ R_b_c,
            self.p + apply(self.R, t_b_c),
            self.v + apply(self.R, v_c),
            self.a + apply(self.R, a_c),
            self.omega @ R_b_c,
            self.alpha @ R_b_c,
        )


def translating(position: Spline, times: Array) -> Motion:
    """Motion without rotation along `position`."""
    p, v, a = (position(times, k) for k in range(3))
    none = np.zeros_like(p)
    return Motion(np.tile(np.eye(3), (len(times), 1, 1)), p, v, a, none, none)


@dataclass(frozen=True, slots=True)
class Nodes:
    """Poses and rates at evenly spaced instants, continued to any time between them.

    At 1 kHz the second-order continuation is exact to nanometres and nanoradians, so every laser
    beam can have its own pose.

    Attributes
    ----------
    start, step : s, time of the first node and spacing
    motion : the motion at the nodes
    """

    start: float
    step: float
    motion: Motion

    def place(self, times: Array, vectors: Array) -> tuple[Array, Array]:
        """Origin of b in the map and `vectors` (N, 3) turned from b into the map, at `times`."""
        index = np.rint((times - self.start) / self.step).astype(np.int64)
        index = np.clip(index, 0, len(self.motion.p) - 1)
        dt = (times - (self.start + self.step * index))[:, None]
        m = self.motion
        origins = m.p[index] + dt * (m.v[index] + 0.5 * dt * m.a[index])
        phi = dt * (m.omega[index] + 0.5 * dt * m.alpha[index])
        turn = cross(phi, vectors)
        return origins, apply(m.R[index], vectors + turn + 0.5 * cross(phi, turn))


def apply(R: Array, vectors: Array) -> Array:
    """`R v` for (N, 3, 3) and (N, 3) or (3,)."""
    turned: Array = np.einsum("nij,nj->ni", R, np.broadcast_to(vectors, (len(R), 3)))
    return turned


def cross(a: Array, b: Array) -> Array:
    """Cross products of (N, 3), several times faster than `numpy.cross`."""
    result = np.empty_like(b)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        result[:, i] = a[:, j] * b[:, k] - a[:, k] * b[:, j]
    return result


def rotation(phi: Array) -> Array:
    """Rotation matrices (N, 3, 3) of rotation vectors (N, 3), by Rodrigues' formula."""
    angle = np.linalg.norm(phi, axis=1)
    # sinc keeps both coefficients exact through zero.
    first = np.sinc(angle / np.pi)[:, None, None]
    second = 0.5 * np.sinc(angle / (2 * np.pi))[:, None, None] ** 2
    K = np.zeros((len(phi), 3, 3))
    K[:, 0, 1], K[:, 0, 2], K[:, 1, 2] = -phi[:, 2], phi[:, 1], -phi[:, 0]
    K -= K.transpose(0, 2, 1)
    result: Array = np.eye(3) + first * K + second * (K @ K)
    return result


def _into(R_b_c: Array, vectors: Array) -> Array:
    result: Array = np.einsum("nji,nj->ni", R_b_c, vectors)
    return result
