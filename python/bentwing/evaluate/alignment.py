# SPDX-License-Identifier: MIT OR Apache-2.0
"""Bring an estimate and the truth to common times and a common frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.errors import InputError
from bentwing.base.trajectory import Trajectory

if TYPE_CHECKING:
    from numpy.typing import NDArray

_FEWEST = 3  # poses that fix an alignment

_ROLL_TOLD = 0.035  # rad; a turn about the path that is less certain is not taken from positions
_LEAST_OFF = 1e-4  # m


@dataclass(frozen=True, slots=True)
class Alignment:
    """Rigid motion from the frame of the estimate to that of the truth: `R p + t`."""

    R: NDArray[np.float64]
    t: NDArray[np.float64]

    def apply(self, trajectory: Trajectory) -> Trajectory:
        """Move a whole trajectory."""
        turned = geometry.multiply(geometry.from_matrices(self.R), trajectory.quats_xyzw)
        return Trajectory(trajectory.times, self.put(trajectory.positions), turned)

    def put(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Move points (N, 3)."""
        moved: NDArray[np.float64] = points @ self.R.T + self.t
        return moved


def associate(
    estimate: Trajectory, truth: Trajectory, during: tuple[float, float] | None = None
) -> tuple[Trajectory, Trajectory]:
    """Interpolate the estimate at the stamps of the truth, where both exist.

    Parameters
    ----------
    estimate, truth : on the same clock
    during : s, first and last time to compare, for instance those in flight

    Raises
    ------
    InputError
        If fewer than three poses remain.
    """
    chosen = estimate.covers(truth.times)
    if during is not None:
        chosen &= (truth.times >= during[0]) & (truth.times <= during[1])
    if np.count_nonzero(chosen) < _FEWEST:
        msg = (
            f"the estimate {_span(estimate)} and the truth {_span(truth)} share "
            f"{np.count_nonzero(chosen)} stamps{'' if during is None else ' in the given interval'}; "
            "at least 3 are needed, on the same clock"
        )
        raise InputError(msg)
    times = truth.times[chosen]
    return (
        Trajectory(times, *estimate.interpolate(times)),
        Trajectory(times, truth.positions[chosen], truth.quats_xyzw[chosen]),
    )


def align(
    points: NDArray[np.float64], targets: NDArray[np.float64], *, yaw_only: bool = False
) -> Alignment:
    """Find the rigid motion, without scale, that brings points nearest to their targets.

    Parameters
    ----------
    points, targets : (N, 3) m
    yaw_only : turn about z only, so that an error of levelling counts

    References
    ----------
    Umeyama 1991, eqs. (34) to (43) with c = 1.
    """
    p, q = points - points.mean(axis=0), targets - targets.mean(axis=0)
    if yaw_only:
        yaw = np.arctan2(np.sum(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]), np.sum(p[:, :2] * q[:, :2]))
        R = geometry.to_matrices(geometry.exp(np.array([0.0, 0.0, yaw])))
    else:
        u, _, vt = np.linalg.svd(q.T @ p)
        mirror = np.diag([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
        R = u @ mirror @ vt
    return Alignment(R, targets.mean(axis=0) - R @ points.mean(axis=0))


def align_poses(estimate: Trajectory, truth: Trajectory) -> Alignment:
    """Align positions as `align` does, with the turn about a straight path from the orientations.

    Parameters
    ----------
    estimate, truth : at the same times
    """
    alignment = align(estimate.positions, truth.positions)
    if tells_roll(alignment, estimate.positions, truth.positions):
        return alignment
    axis = _path(truth.positions)[1]
    aligned = alignment.apply(estimate)
    turns = geometry.multiply(truth.quats_xyzw, geometry.inverse(aligned.quats_xyzw))
    # Of each turn the part about the axis; squared, as q and -q are one rotation.
    parts = (turns[:, 3] + 1j * (turns[:, :3] @ axis)) ** 2
    roll = geometry.to_matrices(geometry.exp(float(np.angle(parts.sum())) * axis))
    R = roll @ alignment.R
    return Alignment(R, truth.positions.mean(axis=0) - R @ estimate.positions.mean(axis=0))


def tells_roll(
    alignment: Alignment, points: NDArray[np.float64], targets: NDArray[np.float64]
) -> bool:
    """Whether positions (N, 3) tell the turn about the path: it bends by much more than they are off."""
    off = float(np.sqrt(((alignment.put(points) - targets) ** 2).sum(axis=1).mean()))
    return max(off, _LEAST_OFF) < _ROLL_TOLD * _path(targets)[0]


def _path(positions: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    """Return how far a path (N, 3) bends, m, and its main direction (3,)."""
    _, extents, axes = np.linalg.svd(positions - positions.mean(axis=0), full_matrices=False)
    return float(extents[1] / np.sqrt(len(positions))), axes[0]


def position_error(points: NDArray[np.float64], targets: NDArray[np.float64]) -> float:
    """Return the root mean square distance of points (N, 3) from their targets once aligned, m."""
    alignment = align(points, targets)
    errors = points @ alignment.R.T + alignment.t - targets
    return float(np.sqrt((errors**2).sum(axis=1).mean()))


def without_frame_rotation(estimate: Trajectory, truth: Trajectory) -> Trajectory:
    """Remove from an aligned estimate the constant rotation of its IMU frame.

    A constant error of the extrinsics turns the body frame and neither the path nor the map, but
    measures that align segments by orientation would read it as drift.

    Parameters
    ----------
    estimate, truth : at the same times, in the same frame
    """
    offsets = geometry.multiply(geometry.inverse(truth.quats_xyzw), estimate.quats_xyzw)
    correction = geometry.inverse(geometry.mean_rotation(offsets))
    return Trajectory(
        estimate.times, estimate.positions, geometry.multiply(estimate.quats_xyzw, correction)
    )


def _span(trajectory: Trajectory) -> str:
    if not len(trajectory.times):
        return "(no pose)"
    return f"({trajectory.times[0]:.1f} to {trajectory.times[-1]:.1f} s)"
