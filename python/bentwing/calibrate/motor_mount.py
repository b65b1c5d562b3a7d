# SPDX-License-Identifier: MIT OR Apache-2.0
"""Least squares for the lidar's place on the motor, from revolutions at rest (Fu 2023, section 2.2).

A return p of the lidar at the encoder's angle θ is, in the frame in which the motor stands,

    x = Rot(axis, θ - θ' delay + ψ) (R p + t),

with R, t of `T_motor_lidar`. The two half-scans of a revolution see the same planes with R and t
turned by half a turn. A wrong R turns them against each other about every direction across the axis,
and a wrong t shifts them. A turn of R about the axis and a shift of t along it move all of the points
alike: nothing can be seen of them, and they stay as they were.

`delay` is by how much the encoder's angle at a lidar stamp is too late; at a constant rate it is one
more turn about the axis. ψ are turns of the single sweeps: the stamps of a sweep are wrong by the same.
Planes are unknown, too; they are eliminated cell by cell.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.errors import DivergedError, RecordingError
from bentwing.base.mount import Pose
from bentwing.calibrate.cells import find_pairs

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.calibrate.cells import Pairs
    from bentwing.calibrate.revolution import Revolutions

    Array = NDArray[np.float64]

# What is assumed before, standard deviations: rad, m, s.
ANGLE_PRIOR, OFFSET_PRIOR, DELAY_PRIOR = 0.1, 0.02, 5e-3
# Of the turns of single sweeps: of the encoder, rad, and of the stamps, s.
SWEEP_ANGLE, SWEEP_TIME = 2e-4, 2e-4
# What of a range's noise remains where a beam is along a plane, as a share.
ALONG = 0.15
# Cauchy's scale in standard deviations, while planes are found and at the end.
CAUCHY = (3.0, 2.0)
# Of a pair whose halves disagree, in standard deviations of their difference, of which this much, m,
# is the surface's: furniture is no plane.
DISAGREEMENT, FLATNESS = 3.0, 1e-3
# Times that the pairs are found anew, and solutions each time; the first of them by every so many of
# the points.
N_ROUGH, MAX_FINE, N_INNER = 3, 6, 2
THINNED = 5
# Of the angles, in standard deviations: a smaller one is the last.
LAST_STEP = 0.05
# Fewer pairs of planes are no room.
MIN_PAIRS = 30
# A larger correction is not one of a mount, rad.
MAX_ANGLE = 0.2
# The unknowns beside the sweeps' turns: two angles, two offsets, the delay.
N_SHARED = 5


@dataclass(frozen=True, slots=True)
class MotorCalibration:
    """The lidar on the motor, and how well it is known.

    Attributes
    ----------
    T_motor_lidar : Pose
    across : (2, 3) the two directions across the axis, motor frame
    delay : s, the encoder's angle at a lidar stamp is that of this much earlier
    correction : (4,) angles, rad, and shifts, m, by which it differs from what was believed
    turns : (S,) rad, of the sweeps beside their angles
    covariance : (5, 5) of the turns about `across`, rad, the shifts along them, m, and the delay, s
    residual_rms : (2,) m, of the points to the planes of their cells, before and after
    n_pairs, n_points : pairs of planes and points in them
    """

    T_motor_lidar: Pose
    across: Array
    delay: float
    correction: Array
    turns: Array
    covariance: Array
    residual_rms: Array
    n_pairs: int
    n_points: int

    @property
    def std(self) -> Array:
        """Standard deviations (5,) of angles, offsets and delay."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


@dataclass(frozen=True, slots=True)
class _Given:
    """What does not change.

    The axis (3,), the directions across it (2, 3), the lidar's place as it was believed to be, and the
    information (5 + S,) about the unknowns before any point.
    """

    axis: Array
    across: Array
    believed: Pose
    prior: Array


@dataclass(slots=True)
class _Unknowns:
    R: Array
    t: Array
    delay: float
    turns: Array


def calibrate_motor(
    seen: Revolutions, axis: Array, T_motor_lidar: Pose, sigma: float
) -> MotorCalibration:
    """Find the lidar's place on the motor.

    Parameters
    ----------
    seen : one revolution at least
    axis : (3,) unit, motor frame
    T_motor_lidar : as it is believed to be
    sigma : m, noise of a range

    Raises
    ------
    RecordingError
        Too few planes are seen in both half-scans.
    DivergedError
        What fits best is far from what was believed.

    References
    ----------
    Fu 2023, section 2.2.
    """
    across = np.linalg.svd(axis[None])[2][1:]
    n_sweeps = int(seen.sweeps.max()) + 1
    x = _Unknowns(T_motor_lidar.R, T_motor_lidar.translation.copy(), 0.0, np.zeros(n_sweeps))
    given = _Given(axis, across, T_motor_lidar, _prior(seen, n_sweeps))
    before = 0.0
    covariance, pairs, rms = np.zeros((N_SHARED, N_SHARED)), None, 0.0
    for outer in range(N_ROUGH + MAX_FINE):
        fine = outer >= N_ROUGH
        used = seen if fine else seen.every(THINNED)
        lidar = Pose(x.t, geometry.from_matrices(x.R))
        pairs = find_pairs(place(used, axis, lidar, x.delay, x.turns), used.halves, sigma)
        _require_room(pairs)
        chosen = _Chosen.of(used, pairs, sigma)
        moved = 0.0
        for _ in range(N_INNER):
            step, covariance, rms = _solve(chosen, x, given, fine=fine)
            before = before or rms
            moved = max(moved, float(np.linalg.norm(step[:2]) / np.sqrt(covariance[0, 0])))
            _apply(x, step, across)
        if fine and moved < LAST_STEP:
            break
    quat = geometry.from_matrices(x.R)
    turn = geometry.log(geometry.multiply(quat, geometry.inverse(T_motor_lidar.quaternion)))
    if not np.linalg.norm(turn) < MAX_ANGLE:
        msg = (
            f"the half-scans fit best with the lidar turned by {np.degrees(np.linalg.norm(turn)):.0f}° "
            "on the motor, which is no error of assembly: check axis and T_motor_lidar of the encoder"
        )
        raise DivergedError(msg)
    assert pairs is not None
    return MotorCalibration(
        Pose(x.t, quat),
        across,
        x.delay,
        _away(x, across, T_motor_lidar),
        x.turns,
        covariance,
        np.array([before, rms]),
        len(pairs),
        len(pairs.index),
    )


def place(seen: Revolutions, axis: Array, lidar: Pose, delay: float, turns: Array) -> Array:
    """Return the points (N, 3) in the frame in which the motor stands, m."""
    angles = seen.angles - seen.rates * delay + turns[seen.sweeps]
    return turned(axis, angles, seen.points @ lidar.R.T + lidar.translation)


def turned(axis: Array, angles: Array, points: Array) -> Array:
    """Turn points (N, 3) about an axis by angles (N,)."""
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    along = (points @ axis)[:, None] * axis
    return np.asarray(along + c * (points - along) + s * np.cross(axis, points))


@dataclass(frozen=True, slots=True)
class _Chosen:
    """The points in pairs, sorted by cell and sweep, and where these begin.

    `firsts` are where a sweep of a cell begins; `group_cell` and `group_sweep` are whose they are.
    """

    points: Array
    angles: Array
    rates: Array
    sweeps: NDArray[np.int64]
    halves: NDArray[np.int64]
    cell: NDArray[np.int64]
    firsts: NDArray[np.int64]
    group_cell: NDArray[np.int64]
    group_sweep: NDArray[np.int64]
    pairs: Pairs
    sigma: float

    @classmethod
    def of(cls, seen: Revolutions, pairs: Pairs, sigma: float) -> _Chosen:
        order = np.lexsort((seen.sweeps[pairs.index], pairs.cell))
        index, cell = pairs.index[order], pairs.cell[order]
        sweeps = seen.sweeps[index]
        new = np.concatenate([[True], (np.diff(cell) != 0) | (np.diff(sweeps) != 0)])
        firsts = np.flatnonzero(new)
        return cls(
            seen.points[index],
            seen.angles[index],
            seen.rates[index],
            sweeps,
            seen.halves[index],
            cell,
            firsts,
            cell[firsts],
            sweeps[firsts],
            pairs,
            sigma,
        )


def _solve(
    chosen: _Chosen, x: _Unknowns, given: _Given, *, fine: bool
) -> tuple[Array, Array, float]:
    """Return a step of all unknowns, the covariance (5, 5) of the shared ones, and the residuals' rms.

    The points of a cell share what is not plane about it, so that cells are what is independent:
    with the gradient g of each, the covariance is `Λ⁻¹ (Σ g gᵀ / κ² + Λ_prior) Λ⁻¹`, κ being the share of
    the weights that is left of them where a residual grows (Huber 1981, section 7.6).
    """
    rows, weights, kappa, rms = _rows(chosen, x, given, fine=fine)
    information, gradients = _normal_equations(chosen, rows, weights, len(x.turns))
    away = np.concatenate([_away(x, given.across, given.believed), [x.delay], x.turns])
    information += np.diag(given.prior)
    inverse = np.linalg.inv(information)
    scatter = gradients.T @ gradients / kappa**2 + np.diag(given.prior)
    covariance = inverse @ scatter @ inverse
    step = -inverse @ (gradients.sum(axis=0) + given.prior * away)
    return step, covariance[:N_SHARED, :N_SHARED], rms


def _rows(
    chosen: _Chosen, x: _Unknowns, given: _Given, *, fine: bool
) -> tuple[Array, Array, float, float]:
    """Return derivatives and residuals (10, M), weights (M,), κ, and the residuals' weighted rms, m.

    The rows: two angles, two offsets, the delay, the sweep's turn, two turns of the plane and its
    height, and the residual.
    """
    pairs, axis, across = chosen.pairs, given.axis, given.across
    turned_points = chosen.points @ x.R.T
    angles = chosen.angles - chosen.rates * x.delay + x.turns[chosen.sweeps]
    arm = turned_points + x.t
    at = turned(axis, angles, arm)
    normal = pairs.normals[chosen.cell]
    back = turned(axis, -angles, normal)
    off = at - pairs.means[chosen.cell]
    residual = np.einsum("mi,mi->m", off, normal)
    about_axis = np.einsum("mi,mi->m", np.cross(axis, at), normal)
    tangents = _tangents(pairs.normals)
    rows = np.empty((10, len(at)))
    # n · Rot (w × R p) = (R p × Rotᵀ n) · w
    rows[0:2] = across @ np.cross(turned_points, back).T
    rows[2:4] = across @ back.T
    rows[4] = -chosen.rates * about_axis
    rows[5] = about_axis
    rows[6] = np.einsum("mi,mi->m", off, tangents[0][chosen.cell])
    rows[7] = np.einsum("mi,mi->m", off, tangents[1][chosen.cell])
    rows[8] = -1.0
    rows[9] = residual
    beam = turned_points / np.linalg.norm(turned_points, axis=1, keepdims=True)
    incidence = np.einsum("mi,mi->m", beam, back)
    variance = chosen.sigma**2 * np.maximum(incidence**2, ALONG**2)
    variance = variance * _roughness(chosen, residual**2 / variance)
    square = residual**2 / (variance * CAUCHY[fine] ** 2)
    weights = 1.0 / (variance * (1.0 + square))
    if fine:
        weights = weights * _agreement(chosen, residual, weights)
    kappa = float(np.sum(weights * (1.0 - square) / (1.0 + square)) / np.sum(weights))
    rms = float(np.sqrt(np.sum(weights * residual**2) / np.sum(weights)))
    return rows, weights, max(kappa, 0.2), rms


def _roughness(chosen: _Chosen, squares: Array) -> Array:
    """Return by how much the points of each cell scatter more than the noise does, at least 1 (M,)."""
    n = np.bincount(chosen.cell, minlength=len(chosen.pairs))
    # The middle of what the outliers leave.
    inside = np.minimum(squares, 9.0)
    mean = np.bincount(chosen.cell, inside, len(chosen.pairs)) / np.maximum(n - 3.0, 1.0)
    return np.asarray(np.maximum(mean, 1.0)[chosen.cell])


def _agreement(chosen: _Chosen, residual: Array, weights: Array) -> Array:
    """Return the weights (M,) of cells by how well their halves agree about the height."""
    n = len(chosen.pairs)
    heights, variances = [], []
    for half in (0, 1):
        mine = np.where(chosen.halves == half, weights, 0.0)
        total = np.maximum(np.bincount(chosen.cell, mine, n), 1e-9)
        heights.append(np.bincount(chosen.cell, mine * residual, n) / total)
        variances.append(1.0 / total)
    apart = (heights[0] - heights[1]) ** 2 / (variances[0] + variances[1] + FLATNESS**2)
    return np.asarray((1.0 / (1.0 + apart / DISAGREEMENT**2))[chosen.cell])


def _normal_equations(
    chosen: _Chosen, rows: Array, weights: Array, n_sweeps: int
) -> tuple[Array, Array]:
    """Return the information (5 + S, 5 + S) and each cell's gradient (C, 5 + S), planes eliminated."""
    sums = np.empty((10, 10, len(chosen.firsts)))
    for i in range(10):
        scaled = rows[i] * weights
        for j in range(i, 10):
            sums[i, j] = sums[j, i] = np.add.reduceat(scaled * rows[j], chosen.firsts)
    size = N_SHARED + n_sweeps
    cells, sweep = chosen.group_cell, N_SHARED + chosen.group_sweep
    n_cells = len(chosen.pairs)
    # Unknowns of the planes: (C, size) couplings per unknown of a plane, and (C, 3, 3) of their own.
    coupling = np.zeros((3, n_cells, size))
    own, rest = np.zeros((n_cells, 3, 3)), np.zeros((n_cells, 3))
    information, gradients = np.zeros((size, size)), np.zeros((n_cells, size))
    information[:N_SHARED, :N_SHARED] = sums[:N_SHARED, :N_SHARED].sum(axis=2)
    for i in range(N_SHARED):
        gradients[:, i] = np.bincount(cells, sums[i, 9], n_cells)
    np.add.at(gradients, (cells, sweep), sums[5, 9])
    np.add.at(information, (sweep, sweep), sums[5, 5])
    for i in range(N_SHARED):
        with_turns = np.bincount(sweep, sums[i, 5], size)
        information[i] += with_turns
        information[:, i] += with_turns
    for a in range(3):
        for i in range(N_SHARED):
            coupling[a, :, i] = np.bincount(cells, sums[6 + a, i], n_cells)
        np.add.at(coupling[a], (cells, sweep), sums[6 + a, 5])
        rest[:, a] = np.bincount(cells, sums[6 + a, 9], n_cells)
        for b in range(3):
            own[:, a, b] = np.bincount(cells, sums[6 + a, 6 + b], n_cells)
    inverse = np.linalg.inv(own + 1e-9 * np.trace(own, axis1=1, axis2=2)[:, None, None] * np.eye(3))
    for a in range(3):
        eliminated = np.einsum("cb,bcs->cs", inverse[:, a], coupling)
        information -= coupling[a].T @ eliminated
        gradients -= eliminated * rest[:, a, None]
    return information, gradients


def _apply(x: _Unknowns, step: Array, across: Array) -> None:
    turn = geometry.to_matrices(geometry.exp(across.T @ step[0:2]))
    x.R = turn @ x.R
    x.t = x.t + across.T @ step[2:4]
    x.delay += float(step[4])
    x.turns = x.turns + step[N_SHARED:]


def _away(x: _Unknowns, across: Array, believed: Pose) -> Array:
    """Return how far angles and offsets (4,) are from what was believed."""
    quat = geometry.multiply(geometry.from_matrices(x.R), geometry.inverse(believed.quaternion))
    return np.concatenate([across @ geometry.log(quat), across @ (x.t - believed.translation)])


def _prior(seen: Revolutions, n_sweeps: int) -> Array:
    """Return the information (5 + S,) that is there before any point."""
    sweep = np.full(n_sweeps, np.hypot(SWEEP_ANGLE, SWEEP_TIME * float(abs(seen.rates).max())))
    std = [ANGLE_PRIOR, ANGLE_PRIOR, OFFSET_PRIOR, OFFSET_PRIOR, DELAY_PRIOR]
    return np.asarray(np.concatenate([std, sweep]) ** -2.0)


def _tangents(normals: Array) -> tuple[Array, Array]:
    """Return two directions (C, 3) in each plane."""
    least = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normals, first)


def _require_room(pairs: Pairs) -> None:
    if len(pairs) >= MIN_PAIRS:
        return
    msg = (
        f"only {len(pairs)} cells show a plane to both halves of the revolution, {MIN_PAIRS} are needed: "
        "calibrate in a room with walls, floor and ceiling, 2 to 15 m from the lidar"
    )
    raise RecordingError(msg)
