# SPDX-License-Identifier: MIT OR Apache-2.0
"""The poses of the scans: what comes next, and the trajectory between them."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.mount import Pose
from bentwing.base.trajectory import DT, Trajectory

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

# Eq. 7 of Tazir 2020 composes four motions between scans. Their mean predicts the velocity; turns
# change faster than that, and are predicted from fewer.
COMPOSED_SHIFTS, COMPOSED_TURNS = 2, 1
# The twist changes by half as much from between two scans to the later one as between scans; part of
# that is noise.
CHANGE = 0.25


@dataclass(frozen=True, slots=True)
class Twist:
    """Velocity and angular rate.

    Attributes
    ----------
    v : (3,) m/s, imu frame
    omega : (3,) rad/s, imu frame
    """

    v: Array
    omega: Array


REST = Twist(np.zeros(3), np.zeros(3))


@dataclass(frozen=True, slots=True)
class Placed(Pose):
    """Pose `T_map_imu` of a scan at its time, s."""

    time: float


def twist_between(before: Placed, after: Placed) -> Twist:
    """Return the constant twist that leads from one pose to another, in the imu frame of the later."""
    dt = after.time - before.time
    back = geometry.inverse(after.quaternion)
    v = geometry.rotate(back, after.translation - before.translation) / dt
    turn = geometry.multiply(geometry.inverse(before.quaternion), after.quaternion)
    return Twist(v, geometry.log(turn) / dt)


class Track:
    """Poses of scans in time order, without a break."""

    def __init__(self, first: Placed) -> None:
        self.poses = [first]

    @property
    def last(self) -> Placed:
        """The newest pose."""
        return self.poses[-1]

    def copy(self) -> Track:
        """Return the track as it is now."""
        return self.sliced(0)

    def sliced(self, first: int, stop: int | None = None) -> Track:
        """Return the poses of a slice, which must not be empty, as a track."""
        part = copy(self)
        part.poses = self.poses[first:stop]
        return part

    def add(self, pose: Placed) -> None:
        """Take the next pose."""
        self.poses.append(pose)

    def twist(self) -> Twist:
        """Return the twist by which the motion is expected to go on (Tazir 2020, eq. 7)."""
        if len(self.poses) < 2:
            return REST
        n = len(self.poses)
        shifts = twist_between(self.poses[max(0, n - 1 - COMPOSED_SHIFTS)], self.last)
        turns = twist_between(self.poses[max(0, n - 1 - COMPOSED_TURNS)], self.last)
        return Twist(shifts.v, turns.omega)

    def twist_at(self, pose: Placed) -> Twist:
        """Return the twist at a pose that follows the last one.

        That from the last pose to this one belongs to the moment between them; it goes on changing as
        it has changed by then.
        """
        now, before = twist_between(self.last, pose), self.twist()
        if len(self.poses) < 2:
            return now
        v, omega = (a + CHANGE * (a - b) for a, b in ((now.v, before.v), (now.omega, before.omega)))
        return Twist(v, omega)

    def expected(self, time: float) -> Placed:
        """Return the pose at a later time if the motion goes on."""
        return moved_on(self.last, self.twist(), time)

    def trajectory(self, start: float, stop: float) -> Trajectory:
        """Poses every `DT` from `start` to at least `stop`: cubic between the scans, straight beyond.

        With the rotation vector r from a scan to a later moment, r and the position have the values
        and slopes of the neighbouring scans (Hermite); rates of some rad/s over a scan make r and
        the rate in the imu frame differ by less than the rate itself changes.
        """
        n = int(np.ceil((stop - start) / DT - 1e-6)) + 1
        times: Array = start + DT * np.arange(float(max(n, 2)))
        if len(self.poses) == 1:
            return Trajectory(times, *_repeated(self.last, len(times)))
        knots = np.array([pose.time for pose in self.poses])
        p = np.array([pose.translation for pose in self.poses])
        q = np.array([pose.quaternion for pose in self.poses])
        steps = np.diff(knots)
        turns = geometry.log(geometry.multiply(geometry.inverse(q[:-1]), q[1:]))
        v, w = _slopes(np.diff(p, axis=0), steps), _slopes(turns, steps)
        i = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(steps) - 1)
        h, u = steps[i, None], ((times - knots[i]) / steps[i])[:, None]
        positions = p[i] + _hermite(u, p[i + 1] - p[i], v[i] * h, v[i + 1] * h)
        turned = _hermite(u, turns[i], w[i] * h, w[i + 1] * h)
        return Trajectory(times, positions, geometry.multiply(q[i], geometry.exp(turned)))


def moved_on(pose: Placed, twist: Twist, time: float) -> Placed:
    """Return where a constant twist leads from a pose."""
    dt = time - pose.time
    shifted = pose.translation + geometry.rotate(pose.quaternion, twist.v * dt)
    turned = geometry.multiply(pose.quaternion, geometry.exp(twist.omega * dt))
    return Placed(shifted, turned / np.linalg.norm(turned), time)


def _repeated(pose: Placed, n: int) -> tuple[Array, Array]:
    return np.tile(pose.translation, (n, 1)), np.tile(pose.quaternion, (n, 1))


def _slopes(shifts: Array, steps: Array) -> Array:
    """Slopes (N + 1, 3) at the ends of N steps: those of the parabola through the neighbours."""
    rates = shifts / steps[:, None]
    share = (steps[:-1] / (steps[:-1] + steps[1:]))[:, None]
    middle = rates[:-1] + share * (rates[1:] - rates[:-1])
    if not len(middle):
        return np.concatenate([rates, rates])
    # The parabola at the ends goes on from the middle of the outermost steps.
    first, last = 2 * rates[:1] - middle[:1], 2 * rates[-1:] - middle[-1:]
    return np.concatenate([first, middle, last])


def _hermite(u: Array, end: Array, slope: Array, end_slope: Array) -> Array:
    """Cubic from zero to `end` over 0 ≤ u ≤ 1 with the given slopes; straight beyond."""
    inside = np.clip(u, 0.0, 1.0)
    u2, u3 = inside**2, inside**3
    curve = (3 * u2 - 2 * u3) * end + (inside - 2 * u2 + u3) * slope + (u3 - u2) * end_slope
    beyond: Array = curve + np.minimum(u, 0.0) * slope + np.maximum(u - 1.0, 0.0) * end_slope
    return beyond
