# SPDX-License-Identifier: MIT OR Apache-2.0
"""Clock offset and lever arm of a reference trajectory, found together with its alignment."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.clock import NS_PER_S
from bentwing.base.errors import InputError
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.alignment import Alignment, align
from bentwing.evaluate.robust import cauchy, scale
from bentwing.evaluate.synchronise import coarse_shifts
from bentwing.evaluate.track import bridges

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.evaluate.track import Track

SAME_CLOCK = 0.01  # s; evo takes stamps of poses that differ by less for the same time
_ARM_SIGMA = 1.0  # m; how long a lever arm may be, for directions that the motion does not show
_SHIFT_SIGMA = 10.0  # s; how far a clock may be from where it is looked for, where no speed changes
_AS_GOOD = 1.5  # times the residual of the best offset; then the clocks are taken to agree
_STILL = 1e-3  # m
_SHARED = 0.5  # of the shorter one; with so much common time the clocks may agree
_ITERATIONS = 60
_FIRST_LOOK = 12  # iterations that tell the right one of several offsets
_MOST_USED = (1500, 20_000)  # measurements, evenly chosen: at the first look, and in the end
_FINEST_SIGMA = 1e-4  # m; no reference is better, and weaker priors would drown in rounding
_HALF_STEP = 0.02  # s, of numerical derivatives, across the vibration
_CONVERGED = 1e-9  # m, rad and s
_FEWEST = 10  # measurements for up to ten unknowns
_COVERED = 0.5  # of the best cover; a fit to less of the track is not compared by its residuals


@dataclass(frozen=True, slots=True)
class TrackedPoint:
    """How a reference trajectory was measured.

    Attributes
    ----------
    clock_offset : s, how far the reference's clock is ahead of the estimate's, as applied
    clock_offset_found : s, as estimated; None where it was given
    clock_offset_std : s, if successive measurements were independent
    lever_arm : m, tracked point in the IMU frame
    lever_arm_std : m, of each component; near 1 m: the motion does not show it; None where given
    """

    clock_offset: float
    clock_offset_found: float | None
    clock_offset_std: float | None
    lever_arm: tuple[float, float, float]
    lever_arm_std: tuple[float, float, float] | None


@dataclass(frozen=True, slots=True)
class _Fit:
    shift: float
    arm: NDArray[np.float64]
    alignment: Alignment
    residual: float
    n_covered: int
    stds: NDArray[np.float64]  # of shift and arm


def find_tracked_point(
    estimate: Trajectory,
    clock_origin_ns: int,
    track: Track,
    *,
    clock_offset: float | None = None,
    lever_arm: tuple[float, float, float] | None = None,
) -> TrackedPoint:
    """Find what is not given by robust least squares on the distances after alignment.

    Parameters
    ----------
    estimate : poses of the IMU
    clock_origin_ns : absolute stamp of the estimate's time zero
    track : the reference
    clock_offset : s, None if unknown
    lever_arm : m, None if unknown

    Raises
    ------
    InputError
        If estimate and reference do not fit together at all.
    """
    if clock_offset is not None and lever_arm is not None:
        return TrackedPoint(clock_offset, None, None, lever_arm, None)
    stamped = (track.origin_ns - clock_origin_ns) / NS_PER_S
    arm = np.zeros(3) if lever_arm is None else np.array(lever_arm)
    free = (clock_offset is None, lever_arm is None)
    if clock_offset is None:
        fit = _best_fit(estimate, track, (_starts(estimate, track, stamped), arm), free)
    else:
        fit = _best_fit(estimate, track, ([stamped - clock_offset], arm), free)
    found = float(stamped - fit.shift)
    applied = found
    if clock_offset is None and track.quats_xyzw is not None:
        same = _fit(estimate, _thinned(track, _MOST_USED[1]), (stamped, arm), (False, free[1]), _ITERATIONS)  # fmt: skip
        if same is not None and (
            abs(found) < SAME_CLOCK or same.residual <= _AS_GOOD * fit.residual
        ):
            fit, applied = replace(same, stds=fit.stds), 0.0
    x, y, z = fit.arm.tolist()
    sx, sy, sz = fit.stds[1:].tolist()
    return TrackedPoint(
        applied if clock_offset is None else clock_offset,
        found if clock_offset is None else None,
        float(fit.stds[0]) if clock_offset is None else None,
        (x, y, z),
        (sx, sy, sz) if lever_arm is None else None,
    )


def _starts(estimate: Trajectory, track: Track, stamped: float) -> list[float]:
    """Return shifts that are worth a look, that of clocks that agree first if it may be.

    Raises
    ------
    InputError
        The speeds tell no shift, and the stamps have nothing in common.
    """
    begin = max(estimate.times[0], track.times[0] + stamped)
    end = min(estimate.times[-1], track.times[-1] + stamped)
    shorter = min(np.ptp(estimate.times), np.ptp(track.times))
    stands_still = float(np.ptp(track.positions, axis=0).max()) < _STILL
    if end - begin < _SHARED * shorter or stands_still:
        return coarse_shifts(estimate, track)
    try:
        return [stamped, *coarse_shifts(estimate, track)]
    except InputError:
        return [stamped]


def moved_to_point(estimate: Trajectory, arm: tuple[float, float, float]) -> Trajectory:
    """Poses of a frame at the tracked point, parallel to the IMU's."""
    if not any(arm):
        return estimate
    reached = geometry.compose(estimate.positions, estimate.quats_xyzw, np.array(arm))
    return Trajectory(estimate.times, reached, estimate.quats_xyzw)


def _best_fit(
    estimate: Trajectory,
    track: Track,
    start: tuple[list[float], NDArray[np.float64]],
    free: tuple[bool, bool],
) -> _Fit:
    few, many = (_thinned(track, most) for most in _MOST_USED)
    looks = [_fit(estimate, few, (shift, start[1]), free, _FIRST_LOOK) for shift in start[0]]
    found = [fit for fit in looks if fit is not None]
    if not found:
        msg = (
            f"the estimate lasts {np.ptp(estimate.times):.1f} s, the reference "
            f"{np.ptp(track.times):.1f} s, and fewer than {_FEWEST} of its {len(track.times)} "
            "measurements fall into the estimate; are both of the same flight, and is the clock "
            "offset right?"
        )
        raise InputError(msg)
    enough = _COVERED * max(fit.n_covered for fit in found)
    covering = [fit for fit in found if fit.n_covered >= enough]
    best = min(covering, key=lambda fit: fit.residual)
    # The first is where the stamps are: a short or even path fits elsewhere as well.
    if covering[0].residual <= _AS_GOOD * best.residual and covering[0] is looks[0]:
        best = covering[0]
    return _fit(estimate, many, (best.shift, best.arm), free, _ITERATIONS) or best


def _thinned(track: Track, most: int) -> Track:
    step = -(-len(track.times) // most)
    return replace(track, times=track.times[::step], positions=track.positions[::step])


def _fit(
    estimate: Trajectory,
    track: Track,
    start: tuple[float, NDArray[np.float64]],
    free: tuple[bool, bool],
    iterations: int,
) -> _Fit | None:
    """Fit with Cauchy weights; None if the shift leaves the common time."""
    shift, arm = start
    begun = shift
    alignment: Alignment | None = None
    sigma = covariance = None
    covered = np.zeros(len(track.times), np.bool_)
    for _ in range(iterations):
        times = track.times + shift
        covered = ~bridges(estimate.times, times)
        if np.count_nonzero(covered) < _FEWEST:
            return None
        measured = track.positions[covered]
        points, velocities, quats = _points(estimate, times[covered], arm)
        alignment = alignment or align(points, measured)
        placed = alignment.put(points)
        residuals = placed - measured
        sizes = np.linalg.norm(residuals, axis=1)
        sigma = max(scale(sizes) / np.sqrt(3), _FINEST_SIGMA)
        design = _design(placed, alignment.R, (velocities, quats), free)
        step, covariance = _solve(
            design, residuals, cauchy(sizes, 3 * sigma), (sigma, shift - begun, arm, free)
        )
        turn = geometry.to_matrices(geometry.exp(step[:3]))
        alignment = Alignment(turn @ alignment.R, turn @ alignment.t + step[3:6])
        shift, arm = shift + float(step[6]), arm + step[7:]
        if np.abs(step).max() < _CONVERGED:
            break
    if alignment is None or sigma is None or covariance is None:
        return None
    stds = np.sqrt(np.maximum(np.diag(covariance)[6:], 0.0))
    return _Fit(shift, arm, alignment, sigma, int(np.count_nonzero(covered)), stds)


def _points(
    estimate: Trajectory, times: NDArray[np.float64], arm: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Tracked points, their velocities, and the orientations of the IMU."""
    positions, quats = estimate.interpolate(times)
    first, last = estimate.times[0], estimate.times[-1]
    before, after = np.maximum(times - _HALF_STEP, first), np.minimum(times + _HALF_STEP, last)
    ends = [geometry.compose(*estimate.interpolate(t), arm) for t in (before, after)]
    velocities = (ends[1] - ends[0]) / (after - before)[:, None]
    return geometry.compose(positions, quats, arm), velocities, quats


def _design(
    placed: NDArray[np.float64],
    R: NDArray[np.float64],
    motion: tuple[NDArray[np.float64], NDArray[np.float64]],
    free: tuple[bool, bool],
) -> NDArray[np.float64]:
    """Derive (N, 3, 10) the residuals to rotation, translation, shift and lever arm."""
    velocities, quats = motion
    design = np.zeros((len(placed), 3, 10))
    x, y, z = placed.T
    # -[placed]x, the perturbation being on the left
    design[:, 0, 1], design[:, 0, 2] = z, -y
    design[:, 1, 0], design[:, 1, 2] = -z, x
    design[:, 2, 0], design[:, 2, 1] = y, -x
    design[:, :, 3:6] = np.eye(3)
    design[:, :, 6] = free[0] * (velocities @ R.T)
    design[:, :, 7:] = free[1] * (R @ geometry.to_matrices(quats))
    return design


def _solve(
    design: NDArray[np.float64],
    residuals: NDArray[np.float64],
    weights: NDArray[np.float64],
    prior: tuple[float, float, NDArray[np.float64], tuple[bool, bool]],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Step (10,) and covariance (10, 10); what is not free stays."""
    sigma, moved, arm, free = prior
    centre = np.zeros(10)
    rows, weighted = design.reshape(-1, 10), (design * weights[:, None, None]).reshape(-1, 10)
    information, gradient = weighted.T @ rows, weighted.T @ residuals.ravel()
    strength = (sigma / _ARM_SIGMA) ** 2
    information[range(7, 10), range(7, 10)] += strength
    centre[7:] = strength * arm * free[1]
    held = (sigma / _SHIFT_SIGMA) ** 2
    information[6, 6] += held
    centre[6] = held * moved * free[0]
    kept = np.array([True] * 6 + [free[0]] + [free[1]] * 3)
    step, covariance = np.zeros(10), np.zeros((10, 10))
    inverse = np.linalg.pinv(information[np.ix_(kept, kept)], rcond=1e-14, hermitian=True)
    step[kept] = -inverse @ (gradient + centre)[kept]
    covariance[np.ix_(kept, kept)] = sigma**2 * inverse
    return step, covariance
