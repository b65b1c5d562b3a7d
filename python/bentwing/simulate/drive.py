# SPDX-License-Identifier: MIT OR Apache-2.0
"""A car that drives along a road: from rest, at about a speed, and to rest again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.simulate.splines import Spline, knot_times
from bentwing.simulate.trajectories import (
    ATTITUDE_STEP,
    POSITION_STEP,
    Flight,
    Phases,
    smoothstep,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bentwing.simulate.scenes import World

    Array = NDArray[np.float64]

START, END = 2.0, 2.0
"""s, of rest before and after."""
ACCELERATION = 1.8
"""m/s², mean of starting and of braking."""
HEIGHT = 0.55
"""m, of the body's origin above the road."""
BOUNCE, JITTER = 0.004, np.radians(0.15)
"""Standard deviations of the controls of height and attitude while it drives."""
SQUAT = 0.006
"""rad per m/s² of acceleration, by which the nose rises."""
STEP = 0.01
MARGIN = 5.0
"""m, from both ends of the road."""


@dataclass(frozen=True, slots=True)
class Driven:
    """How far along the road the car is.

    Attributes
    ----------
    times, speeds, way : (N,) s, m/s, m
    """

    times: Array
    speeds: Array
    way: Array

    def way_at(self, times: Array) -> Array:
        """Way driven (M,), m, at `times`."""
        return np.interp(times, self.times, self.way)

    def moves(self, times: Array) -> NDArray[np.bool_]:
        """Whether it moves (M,), at `times`."""
        return np.interp(times, self.times, self.speeds) > 0.5


def drive(world: World, rng: np.random.Generator, duration: float) -> Flight:
    """Drive along the site's road; the attitude follows the road and the acceleration.

    Raises
    ------
    UsageError
        If the road is too short for the time, or the time for the speed.
    """
    road = np.array(world.site.road)
    steps = np.linalg.norm(np.diff(road, axis=0), axis=1)
    reached = np.concatenate([[0.0], np.cumsum(steps)])
    driven = _driven(rng, world.site.speed, duration)
    if driven.way[-1] > reached[-1] - MARGIN:
        msg = (
            f"the drive is {driven.way[-1]:.0f} m long, the road {reached[-1] - MARGIN:.0f} m: "
            "choose a shorter duration or a lower speed"
        )
        raise UsageError(msg)

    def along(way: Array) -> Array:
        return np.column_stack([np.interp(way, reached, road[:, i]) for i in range(3)])

    knots = knot_times(POSITION_STEP, duration)
    lift = HEIGHT + rng.normal(0.0, BOUNCE, len(knots)) * driven.moves(knots)
    places = along(driven.way_at(knots)) + np.outer(lift, [0.0, 0.0, 1.0])
    end = duration - END
    moving = Phases(START, START, START, end, end, duration)
    yaw, pitch, roll = _attitude(rng, along, driven, duration)
    return Flight(Spline(POSITION_STEP, places), yaw, pitch, roll, moving)


def _driven(rng: np.random.Generator, speed: float, duration: float) -> Driven:
    """From rest to about `speed`, which wanders by a tenth, and to rest again."""
    rise, end = speed / ACCELERATION, duration - END
    shortest = START + END + 2.2 * rise
    if duration < shortest:
        msg = (
            f"a drive at {speed:g} m/s takes at least {np.ceil(shortest):.0f} s, "
            f"{duration:g} s were asked for"
        )
        raise UsageError(msg)
    times = np.arange(0.0, duration + 4.0, STEP)
    wander = 1.0 + 0.1 * np.sin(2 * np.pi * times / 17.0 + rng.uniform(0.0, 2 * np.pi))
    shape = smoothstep((times - START) / rise) * smoothstep((end - times) / rise)
    speeds = speed * wander * shape
    return Driven(times, speeds, MARGIN + np.cumsum(speeds) * STEP)


def _attitude(
    rng: np.random.Generator, along: Callable[[Array], Array], driven: Driven, duration: float
) -> tuple[Spline, Spline, Spline]:
    """Return yaw, pitch and roll: along the road, nose up when it accelerates."""
    knots = knot_times(ATTITUDE_STEP, duration)
    # At rest the car looks along the road as well.
    ahead = along(driven.way_at(knots) + 1.0) - along(driven.way_at(knots) - 1.0)
    yaw = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    slope = np.arctan2(ahead[:, 2], np.linalg.norm(ahead[:, :2], axis=1))
    acceleration = np.interp(knots, driven.times, np.gradient(driven.speeds, STEP))
    jitter = rng.normal(0.0, JITTER, (2, len(knots))) * driven.moves(knots)
    pitch = -slope - SQUAT * acceleration + jitter[0]
    controls = (yaw, pitch, jitter[1])
    first, second, third = (Spline(ATTITUDE_STEP, angle[:, None]) for angle in controls)
    return first, second, third
