# SPDX-License-Identifier: MIT OR Apache-2.0
"""How the uncertainty of the poses grows from window to window."""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.covariances import (
    PoseCovariances,
    carried,
    levelled_covariances,
    positive_part,
    short_pairs,
)
from bentwing.odometry.continuous.slow_states import SLICES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing import _core
    from bentwing.base.trajectory import Trajectory

# Heading is held by the matches alone: it has all of their common errors, and a variance larger by this.
# Measured with `python -m benches deviations`, as is the next one.
HEADING = 2.0
# Later windows still learn of gravity: so large a share of the variance that the last one states.
GRAVITY = 0.5

_SAME = 1e-6  # s
_HEADING_SCALE = np.sqrt([1.0, 1.0, HEADING, 1.0, 1.0, 1.0])


class Drift:
    """Covariances of the poses that leave the windows, relative to where the pass begins.

    Heading and position drift. Tilt does not: gravity is seen all the time, and what is not known of it
    turns the whole map.

    Parameters
    ----------
    n_views : views that hold a window; what it errs by becomes one of those that hold later ones, so that
        this share of it adds up
    """

    def __init__(self, n_views: int) -> None:
        self._share = 1.0 / max(1, n_views)
        self._times: list[float] = []
        self._left: list[NDArray[np.float64]] = []
        self._end: tuple[float, NDArray[np.float64]] | None = None
        self._gravity_std = np.zeros(2)

    def add(self, result: _core.Registration, start: float, leaving: float, end: float) -> None:
        """Take the next window.

        Parameters
        ----------
        start : s, of the window, where it joins what is final
        leaving : s, up to which poses are final when the next window begins
        end : s, of the lidar data
        """
        samples, inflation = result.samples, inflation_of(result)
        if not self._times:
            self._times.append(start)
            self._left.append(np.zeros((6, 6)))
        joined = samples.position_at(max(start, samples.start))
        # The first windows grow from one start.
        before = without_tilt(self._left[max(0, bisect_right(self._times, start + _SAME) - 1)])

        def at(time: float) -> NDArray[np.float64]:
            gained = result.covariance_at(time) * np.outer(_HEADING_SCALE, _HEADING_SCALE)
            away = samples.position_at(time) - joined
            return np.asarray(carried(before, away) + self._share * inflation * gained)

        self._end = (end, at(end))
        if leaving > start:
            self._times.append(leaving)
            self._left.append(at(leaving))
        variances = np.diag(result.covariance)[SLICES["gravity"]]
        self._gravity_std = np.sqrt(GRAVITY * inflation * np.maximum(variances, 0.0))

    def covariances(self, trajectory: Trajectory, origin: NDArray[np.float64]) -> PoseCovariances:
        """Return those of some poses of the level `trajectory` of the pass.

        Parameters
        ----------
        origin : (3,) m, about which it was levelled
        """
        drifted = self._drifted(trajectory)
        away = trajectory.interpolate(drifted.times)[0] - origin
        return drifted.levelled(away, self._gravity_std)

    def short_covariances(self, trajectory: Trajectory) -> NDArray[np.float64]:
        """Return those (M, 6, 6) of poses as seen from the ones ten metres before."""
        drifted = self._drifted(trajectory)
        positions = trajectory.interpolate(drifted.times)[0]
        pairs = short_pairs(drifted.times, positions)
        away = np.diff(positions[pairs], axis=1)[:, 0]
        since = [
            drifted.matrices[last] - carried(without_tilt(drifted.matrices[first]), apart)
            for (first, last), apart in zip(pairs.tolist(), away, strict=True)
        ]
        matrices = positive_part(np.array(since).reshape(-1, 6, 6))
        return levelled_covariances(matrices, away, self._gravity_std)

    def _drifted(self, trajectory: Trajectory) -> PoseCovariances:
        """Return what has added up, before the doubt about the vertical."""
        times, matrices = [*self._times], [*self._left]
        if self._end is not None and self._end[0] > times[-1]:
            times.append(self._end[0])
            matrices.append(self._end[1])
        known = np.array(times)
        inside = trajectory.covers(known)
        return PoseCovariances(known[inside], np.array(matrices).reshape(-1, 6, 6)[inside])


def without_tilt(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a covariance (6, 6) of a pose whose tilt is known."""
    kept = covariance.copy()
    kept[:2], kept[:, :2] = 0.0, 0.0
    return kept


def inflation_of(result: _core.Registration) -> float:
    """How much larger the covariance of a window is than it says, by its own residuals."""
    rms = (result.residual_rms, result.gyro_rms, result.accel_rms)
    return max(1.0, *(r**2 for r in rms if r is not None))
