# SPDX-License-Identifier: MIT OR Apache-2.0
"""A dense trajectory that follows the corrected poses of its nodes without steps.

Each node says how the trajectory is to turn and where it is to be at one time. The turns C are
joined by a curve with a continuous rate: between two nodes `C(t) = Exp(ψ(t)) C_k` with ψ a cubic
that begins and ends with the rates of the nodes, which are those of an interpolating cubic spline.
Every step of the trajectory is turned by C where it is made, so that its shape between two nodes is
turned and not bent; what is left to the nodes' positions is added as a cubic spline.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory

if TYPE_CHECKING:
    from numpy.typing import NDArray

_SMALL_ANGLE = 1e-4  # below it the series of the inverse Jacobian's factor is exact


def deform_trajectory(
    trajectory: Trajectory,
    times: NDArray[np.float64],
    positions: NDArray[np.float64],
    quats_xyzw: NDArray[np.float64],
) -> Trajectory:
    """Bend a trajectory so that it passes through poses at some of its times.

    Position and rotation are changed by amounts with continuous rates; before the first and after
    the last time the change is a constant turn and shift.

    Parameters
    ----------
    trajectory : `T_map_imu`, dense
    times : (K,) float64, s, increasing, all within the trajectory
    positions : (K, 3) float64, m, map frame, where it is to be then
    quats_xyzw : (K, 4) float64, `R_map_imu` then

    Raises
    ------
    ValueError
        If a time is outside the trajectory, the times do not increase, or the shapes differ.
    """
    _require_nodes(times, positions, quats_xyzw)
    measured, turned = trajectory.interpolate(times)
    turns = geometry.multiply(quats_xyzw, geometry.inverse(turned))
    # Nodes join the samples, so that the path passes through them exactly.
    dense = np.union1d(trajectory.times, times)
    path, _ = trajectory.interpolate(dense)
    path[np.searchsorted(dense, times)] = measured
    middles = _turns_at(0.5 * (dense[1:] + dense[:-1]), times, turns)
    steps = geometry.rotate(middles, np.diff(path, axis=0))
    turned_path = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    offsets = positions - turned_path[np.searchsorted(dense, times)]
    samples = np.searchsorted(dense, trajectory.times)
    shifts = _spline_at(trajectory.times, times, offsets)
    rotations = geometry.multiply(_turns_at(trajectory.times, times, turns), trajectory.quats_xyzw)
    return Trajectory(trajectory.times, turned_path[samples] + shifts, rotations)


def _require_nodes(
    times: NDArray[np.float64], positions: NDArray[np.float64], quats: NDArray[np.float64]
) -> None:
    n = len(times)
    if n < 1 or positions.shape != (n, 3) or quats.shape != (n, 4):
        msg = (
            f"expected times (K,), positions (K, 3) and quats_xyzw (K, 4) with K at least 1, "
            f"got {times.shape}, {positions.shape} and {quats.shape}"
        )
        raise ValueError(msg)
    late = np.diff(times) <= 0
    if late.any():
        msg = f"times: must increase, element {int(np.argmax(late)) + 1} does not"
        raise ValueError(msg)


def _spline_at(
    times: NDArray[np.float64], knots: NDArray[np.float64], values: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Values `(N, D)` at `times` of the cubic spline through `values` `(K, D)`, level at its ends."""
    if len(knots) == 1:
        return values.repeat(len(times), 0)
    h = np.diff(knots)[:, None]
    slopes = _spline_slopes(h, np.diff(values, axis=0))
    k, u = _located(times, knots)
    start, end, rise = h[k] * slopes[k], h[k] * slopes[k + 1], values[k + 1] - values[k]
    return values[k] + _hermite(u, rise, start, end)


def _turns_at(
    times: NDArray[np.float64], knots: NDArray[np.float64], turns: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Rotations `(N, 4)` at `times` of the curve through `turns` `(K, 4)`, at rest at its ends."""
    if len(knots) == 1:
        return turns.repeat(len(times), 0)
    h = np.diff(knots)[:, None]
    rises = geometry.log(geometry.multiply(turns[1:], geometry.inverse(turns[:-1])))
    rates = _spline_slopes(h, rises)
    ends = _rate_of_logarithm(rises, rates[1:])
    k, u = _located(times, knots)
    grown = _hermite(u, rises[k], h[k] * rates[k], h[k] * ends[k])
    return geometry.multiply(geometry.exp(grown), turns[k])


def _located(
    times: NDArray[np.float64], knots: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Interval of each time and the fraction `(N, 1)` of it, clamped to the ends."""
    k = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(knots) - 2)
    u = np.clip((times - knots[k]) / (knots[k + 1] - knots[k]), 0.0, 1.0)
    return k, u[:, None]


def _hermite(
    u: NDArray[np.float64],
    rise: NDArray[np.float64],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Cubic that is 0 at u = 0 and `rise` at u = 1, with these derivatives there."""
    curve: NDArray[np.float64] = (
        u * u * (3 - 2 * u) * rise + u * (1 - u) ** 2 * start - u * u * (1 - u) * end
    )
    return curve


def _spline_slopes(h: NDArray[np.float64], rises: NDArray[np.float64]) -> NDArray[np.float64]:
    """Slopes `(K, D)` at the knots with which the second derivative is continuous; 0 at both ends.

    Parameters
    ----------
    h : (K − 1, 1) intervals
    rises : (K − 1, D) differences of neighbouring values

    References
    ----------
    De Boor 1978, A practical guide to splines, chapter IV, eq. (8), complete spline.
    """
    slopes = np.zeros((len(h) + 1, rises.shape[1]))
    if len(h) == 1:
        return slopes
    # h_k s_{k−1} + 2 (h_{k−1} + h_k) s_k + h_{k−1} s_{k+1} = 3 (h_k d_{k−1} + h_{k−1} d_k),
    # with d the rises per interval; solved by elimination, from the front and back again.
    d = rises / h
    right = 3 * (h[1:] * d[:-1] + h[:-1] * d[1:])
    diagonal = 2 * (h[1:] + h[:-1])
    for k in range(1, len(right)):
        factor = h[k + 1] / diagonal[k - 1]
        diagonal[k] -= factor * h[k - 1]
        right[k] -= factor * right[k - 1]
    for k in range(len(right) - 1, -1, -1):
        slopes[k + 1] = (right[k] - h[k] * slopes[k + 2]) / diagonal[k]
    return slopes


def _rate_of_logarithm(
    vectors: NDArray[np.float64], rates: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Differentiate `Log` where the rotation `Exp(vectors)` turns at `rates`, in the fixed frame.

    `J_l⁻¹ ω = ω − ½ φ×ω + c φ×(φ×ω)` (Barfoot 2017, eq. 7.77).
    """
    angles = np.linalg.norm(vectors, axis=-1, keepdims=True)
    safe = np.maximum(angles, _SMALL_ANGLE)
    c = np.where(angles < _SMALL_ANGLE, 1 / 12, (1 - 0.5 * safe / np.tan(0.5 * safe)) / safe**2)
    once = np.cross(vectors, rates)
    derivative: NDArray[np.float64] = rates - 0.5 * once + c * np.cross(vectors, once)
    return derivative
