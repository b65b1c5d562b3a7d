# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where a recording breaks, and the stretches of trajectory between the breaks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.breaks import HEAD, Break
from bentwing.base.trajectory import DT, Trajectory

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.window_record import WindowRecord

# After a longer silence the estimate may have lost its place, s: without the IMU because a spinning
# head turns by a radian at an unknown rate; without the lidar because the integrated noise of the
# IMU has become decimetres.
MAX_IMU_GAP = 0.3
MAX_LIDAR_GAP = 5.0
MAX_LIDAR_GAP_WITHOUT_IMU = 1.0
# Whether the place was lost shows in the windows that end this long after a silence, s.
JUDGED = (1.5, 6.0)
# An estimate that fell into wrong matches leaves this much smaller a share of them as inliers.
LOST_INLIERS = 0.03
# And those that fit, fit so much worse. Measured behind stalls of 4 to 30 s that were survived: at most
# 1.2 times the residual of before; behind one that was not: twice, with only 0.027 fewer inliers.
LOST_RESIDUAL = 1.4
# The motion at the end of a segment is taken from this much of it, s.
RECENT = 0.1


def extrapolated(
    trajectory: Trajectory, time: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Position (3,) and attitude (4,) at a later time if the last motion goes on."""
    times, positions, quats = trajectory.times, trajectory.positions, trajectory.quats_xyzw
    dt = times[1] - times[0]
    n = min(round(RECENT / dt), len(times) - 1)
    share = (time - times[-1]) / (n * dt)
    before, last = quats[-1 - n][None], quats[-1][None]
    turn = geometry.log(geometry.multiply(last, geometry.inverse(before)))
    quat = geometry.multiply(geometry.exp(share * turn), last)
    return positions[-1] + share * (positions[-1] - positions[-1 - n]), quat.reshape(4)


def found_again(windows: Sequence[WindowRecord], silence: Break) -> bool:
    """Whether the windows after a silence fit their surroundings as well as those before."""
    before = [w for w in windows if w.time <= silence.start]
    first, last = silence.stop + JUDGED[0], silence.stop + JUDGED[1]
    after = [w for w in windows if first <= w.time <= last]
    if not before or not after:
        # Too little was seen since a head has turned again to doubt what its planes have told.
        return silence.sensor == HEAD
    usual, now = (
        np.array([(w.inlier_share, w.residual_rms) for w in part], dtype=np.float64)
        for part in (before, after)
    )
    fits = np.mean(now[:, 0]) > np.median(usual[:, 0]) - LOST_INLIERS
    sharp = np.mean(now[:, 1]) < LOST_RESIDUAL * np.median(usual[:, 1])
    return bool(fits and sharp)


def heading(quat: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the part (4,) of a rotation (4,) that turns about the vertical."""
    twist = np.array([0.0, 0.0, quat[2], quat[3]])
    length = np.linalg.norm(twist)
    return np.array([0.0, 0.0, 0.0, 1.0]) if length < 1e-9 else twist / length


def turned(
    trajectory: Trajectory, turn: NDArray[np.float64], about: NDArray[np.float64] | None = None
) -> Trajectory:
    """Return a trajectory in the frame that a rotation (4,) leads to, `about` (3,) as its origin."""
    positions = trajectory.positions if about is None else trajectory.positions - about
    return Trajectory(
        trajectory.times,
        geometry.rotate(turn, positions),
        geometry.multiply(turn, trajectory.quats_xyzw),
    )


def joined(segments: Sequence[Trajectory], dt: float = DT) -> Trajectory:
    """One trajectory at a uniform rate, with straight motion over the breaks."""
    if len(segments) == 1:
        return segments[0]
    poses = Trajectory(
        np.concatenate([s.times for s in segments]),
        np.concatenate([s.positions for s in segments]),
        np.concatenate([s.quats_xyzw for s in segments]),
    )
    first, last = poses.times[0], poses.times[-1]
    n = int((last - first) / dt + 1e-6) + 1
    times = np.minimum(first + dt * np.arange(n), last)
    return Trajectory(times, *poses.interpolate(times))
