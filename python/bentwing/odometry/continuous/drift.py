# SPDX-License-Identifier: MIT OR Apache-2.0
"""How the uncertainty of the poses grows from window to window."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.covariances import PoseCovariances, carried
from bentwing.odometry.continuous.slow_states import SLICES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing import _core
    from bentwing.base.trajectory import Trajectory

# What a window does not know of its end it shares with the next one, which sees most of the same surfaces
# and the same fixed views: so large a share of the variance adds up. Measured with `python -m benches
# deviations`, as are the next four.
NEW_SHARE = 0.15
# Ranges are better than stated, and matches share their errors. As long as the normalized residuals are
# below this the two make up for each other; beyond, the poses are as much worse as the residuals.
USUAL_RESIDUAL = 0.35
# The same of the overdispersion of a global registration.
USUAL_DISPERSION = 0.1
# Heading is held by the matches alone: it has all of their common errors, and a variance larger by this.
HEADING = 2.0
# Later windows still learn of gravity: so large a share of the variance that the last one states.
GRAVITY = 0.5

_HEADING_SCALE = np.sqrt([1.0, 1.0, HEADING, 1.0, 1.0, 1.0])


def with_heading(covariances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return covariances (..., 6, 6) with a larger doubt about the heading."""
    return np.asarray(_HEADING_SCALE[:, None] * covariances * _HEADING_SCALE)


class Drift:
    """Covariances of the poses that leave the windows, relative to where the pass begins.

    Heading and position drift. Tilt does not: gravity is seen all the time, and what is not known of it
    turns the whole map.
    """

    def __init__(self) -> None:
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
        before = self._left[-1].copy()
        before[:2], before[:, :2] = 0.0, 0.0

        def at(time: float) -> NDArray[np.float64]:
            gained = NEW_SHARE * inflation * with_heading(result.covariance_at(time))
            return carried(before, samples.position_at(time) - joined) + gained

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
        times, matrices = [*self._times], [*self._left]
        if self._end is not None and self._end[0] > times[-1]:
            times.append(self._end[0])
            matrices.append(self._end[1])
        known = np.array(times)
        inside = trajectory.covers(known)
        drifted = PoseCovariances(known[inside], np.array(matrices).reshape(-1, 6, 6)[inside])
        away = trajectory.interpolate(drifted.times)[0] - origin
        return drifted.levelled(away, self._gravity_std)


def inflation_of(result: _core.Registration) -> float:
    """How much larger the covariance of a window is than it says, by its own residuals."""
    imu = [rms**2 for rms in (result.gyro_rms, result.accel_rms) if rms is not None]
    return max(1.0, (result.residual_rms / USUAL_RESIDUAL) ** 2, *imu)
