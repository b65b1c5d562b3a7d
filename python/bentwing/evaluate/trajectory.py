# SPDX-License-Identifier: MIT OR Apache-2.0
"""Errors of a trajectory against the truth on one clock: absolute, and drift per metre."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.evaluate.alignment import (
    Alignment,
    align,
    align_poses,
    associate,
    without_frame_rotation,
)
from bentwing.evaluate.statistics import Statistics

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory

Interval = tuple[float, float]
_ODOMETER_STEP = 0.1  # s; the length of the way is measured in these, so that vibration adds none


@dataclass(frozen=True, slots=True)
class AbsoluteError:
    """Absolute trajectory error after alignment.

    Attributes
    ----------
    position : of the distances, m
    horizontal, vertical : root mean square of the parts of the distance, m
    rotation : of the angles, rad, without the constant rotation of the IMU frame
    frame_rotation : that constant rotation, rad
    times, distances : (N,) s and m
    alignment : from the map of the estimate to that of the truth
    """

    position: Statistics
    horizontal: float
    vertical: float
    rotation: Statistics
    frame_rotation: float
    times: NDArray[np.float64]
    distances: NDArray[np.float64]
    alignment: Alignment


@dataclass(frozen=True, slots=True)
class Drift:
    """Drift over segments of one length.

    Attributes
    ----------
    length : m, of the way in a segment
    horizontal : (K, 2) m per m, in the level frame that has the heading of the IMU at the start
    vertical : (K,) m per m
    rotation : (K, 3) rad, roll, pitch and yaw in that frame, over the whole segment
    """

    length: float
    horizontal: NDArray[np.float64]
    vertical: NDArray[np.float64]
    rotation: NDArray[np.float64]

    @property
    def horizontal_median(self) -> float:
        """Median length of the horizontal drift, m per m."""
        return float(np.median(np.hypot(*self.horizontal.T)))

    @property
    def vertical_median(self) -> float:
        """Median of the absolute vertical drift, m per m."""
        return float(np.median(np.abs(self.vertical)))

    @property
    def yaw_median(self) -> float:
        """Median of the absolute drift about the vertical, rad over the segment."""
        return float(np.median(np.abs(self.rotation[:, 2])))


def absolute_error(
    estimate: Trajectory,
    truth: Trajectory,
    *,
    during: Interval | None = None,
    yaw_only: bool = False,
) -> AbsoluteError:
    """Absolute trajectory error: distances at the stamps of the truth after alignment.

    Parameters
    ----------
    estimate, truth : on the same clock
    during : s, part to align and compare, for instance in flight
    yaw_only : align by a turn about z and a shift only, so that an error of levelling counts
    """
    matched, truth = associate(estimate, truth, during)
    alignment = (
        align(matched.positions, truth.positions, yaw_only=True)
        if yaw_only
        else align_poses(matched, truth)
    )
    aligned = alignment.apply(matched)
    errors = aligned.positions - truth.positions
    distances = np.linalg.norm(errors, axis=1)
    corrected = without_frame_rotation(aligned, truth)
    frame = geometry.multiply(geometry.inverse(corrected.quats_xyzw[0]), aligned.quats_xyzw[0])
    return AbsoluteError(
        Statistics.of(distances),
        float(np.sqrt(np.mean(errors[:, 0] ** 2 + errors[:, 1] ** 2))),
        float(np.sqrt(np.mean(errors[:, 2] ** 2))),
        Statistics.of(angles(truth.quats_xyzw, corrected.quats_xyzw)),
        float(np.linalg.norm(geometry.log(frame))),
        truth.times,
        distances,
        alignment,
    )


def drift(
    estimate: Trajectory,
    truth: Trajectory,
    *,
    lengths: Sequence[float] = (10.0,),
    during: Interval | None = None,
    step: float = 0.5,
) -> list[Drift]:
    """Drift after a distance: poses aligned at the start of a segment, compared at its end.

    Parameters
    ----------
    estimate, truth : on the same clock, the truth with z up
    lengths : m, of the way along the truth
    during : s, part to compare
    step : m, along the way between the starts of two segments

    Returns
    -------
    One `Drift` per length that fits into the trajectory.

    References
    ----------
    Kaul 2015, section 4.2 and figure 24.
    """
    estimate, truth = _comparable(estimate, truth, during)
    times, way = _odometer(truth)
    drifts = []
    for length in lengths:
        starts = np.arange(0.0, way[-1] - length, step)
        if not len(starts):
            continue
        begin, end = np.interp(starts, way, times), np.interp(starts + length, way, times)
        drifts.append(_drift(estimate, truth, (begin, end), length))
    return drifts


def _drift(
    estimate: Trajectory,
    truth: Trajectory,
    segments: tuple[NDArray[np.float64], NDArray[np.float64]],
    length: float,
) -> Drift:
    t_estimate, q_estimate = _motion(estimate, *segments)
    t_truth, q_truth = _motion(truth, *segments)
    level = _levelled(truth.interpolate(segments[0])[1])
    error = geometry.rotate(level, t_estimate - t_truth) / length
    turn = geometry.log(geometry.multiply(q_estimate, geometry.inverse(q_truth)))
    return Drift(length, error[:, :2], error[:, 2], geometry.rotate(level, turn))


def _levelled(quats: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation from the IMU frame into the level frame of the same heading."""
    forward = geometry.rotate(quats, np.array([1.0, 0.0, 0.0]))
    heading = np.arctan2(forward[:, 1], forward[:, 0])
    back = geometry.exp(np.stack([0 * heading, 0 * heading, -heading], axis=1))
    return geometry.multiply(back, quats)


def _comparable(
    estimate: Trajectory, truth: Trajectory, during: Interval | None
) -> tuple[Trajectory, Trajectory]:
    """Both at the same times and in one frame, without the constant rotation of the IMU frame."""
    matched, truth = associate(estimate, truth, during)
    aligned = align_poses(matched, truth).apply(matched)
    return without_frame_rotation(aligned, truth), truth


def _motion(
    trajectory: Trajectory, start: NDArray[np.float64], end: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Motion from `start` to `end` in the frame at `start`: translations and rotations."""
    p0, q0 = trajectory.interpolate(start)
    p1, q1 = trajectory.interpolate(end)
    back = geometry.inverse(q0)
    return geometry.rotate(back, p1 - p0), geometry.multiply(back, q1)


def angles(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles `(N,)` rad between orientations `(N, 4)`."""
    turns = geometry.log(geometry.multiply(geometry.inverse(a), b))
    sizes: NDArray[np.float64] = np.linalg.norm(turns, axis=1)
    return sizes


def _odometer(truth: Trajectory) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Measure the way: times and its length until then."""
    times = np.append(np.arange(truth.times[0], truth.times[-1], _ODOMETER_STEP), truth.times[-1])
    positions, _ = truth.interpolate(times)
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    return times, np.concatenate([[0.0], np.cumsum(steps)])
