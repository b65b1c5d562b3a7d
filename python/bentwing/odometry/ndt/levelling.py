# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which way is up: all that the odometry asks of an IMU."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.odometry.segments import turned
from bentwing.odometry.start import levelling

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.recording import ImuBatch

# The mean force over this time from the first pose on is gravity but for the change of velocity, s.
SPAN = 10.0
# The change of velocity is that of the mean velocities over this time, s.
VELOCITY_SPAN = 0.3
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True)
class Frame:
    """The level map, seen from that of the first scan.

    Attributes
    ----------
    turn : (4,) from the map of the first scan
    origin : (3,) m, in the map of the first scan
    """

    turn: NDArray[np.float64]
    origin: NDArray[np.float64]

    def level(self, trajectory: Trajectory) -> Trajectory:
        """Return a trajectory of the first scan's map in this one."""
        return turned(trajectory, self.turn, self.origin)


class Levelling:
    """Collects the force that the IMU felt at the start."""

    def __init__(self) -> None:
        self._times: list[NDArray[np.float64]] = []
        self._forces: list[NDArray[np.float64]] = []

    def add(self, batch: ImuBatch) -> None:
        """Take samples; those after the start are not held."""
        if not len(batch.times) or (self._times and batch.times[0] > self._times[0][0] + 2 * SPAN):
            return
        self._times.append(batch.times)
        self._forces.append(batch.accel)

    def copy(self) -> Levelling:
        """Return what is collected by now."""
        if self._times:  # one array of many single samples, which take long to join
            self._times = [np.concatenate(self._times)]
            self._forces = [np.concatenate(self._forces)]
        collected = Levelling()
        collected._times, collected._forces = [*self._times], [*self._forces]
        return collected

    @property
    def has_samples(self) -> bool:
        """Whether there is an IMU."""
        return bool(self._times)

    def frame(self, trajectory: Trajectory) -> Frame:
        """Return the level map that begins with a trajectory of the first scan's map."""
        return Frame(self._turn(trajectory), trajectory.positions[0])

    def _turn(self, trajectory: Trajectory) -> NDArray[np.float64]:
        """Quaternion (4,) that makes a trajectory's map level; none without samples.

        The force turned into the map is gravity plus acceleration, whose mean is the change of the
        velocity over the time.
        """
        if not self._times:
            return LEVEL
        times = np.concatenate(self._times)
        first, last = trajectory.times[0], min(trajectory.times[0] + SPAN, trajectory.times[-1])
        inside = (times >= first) & (times <= last)
        if not inside.any() or last - first < 2 * VELOCITY_SPAN:
            return LEVEL
        _, quats = trajectory.interpolate(times[inside])
        force = geometry.rotate(quats, np.concatenate(self._forces)[inside]).mean(axis=0)
        ends = np.array([first, first + VELOCITY_SPAN, last - VELOCITY_SPAN, last])
        p, _ = trajectory.interpolate(ends)
        gained = ((p[3] - p[2]) - (p[1] - p[0])) / VELOCITY_SPAN
        return levelling(force - gained / (last - first))
