# SPDX-License-Identifier: MIT OR Apache-2.0
"""How the carrier moves: a quadrotor's flight, as smooth functions with exact derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.simulate.events import gust_shifts
from bentwing.simulate.kinematics import Motion, translating
from bentwing.simulate.planner import Tour, follow_route, plan_tour
from bentwing.simulate.splines import Spline, knot_times

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.scenes import World

    Array = NDArray[np.float64]

GRAVITY = 9.80665
"""m/s², standard gravity."""

X, Y, Z = np.eye(3)

POSITION_STEP, ATTITUDE_STEP, YAW_STEP = 0.5, 0.2, 1.0
WOBBLE = 0.02
"""m, standard deviation of the position's controls in flight."""
JITTER = np.radians(1.8)
"""Standard deviation of the attitude's controls; the spline passes about 60 % of it."""
DRAG = 0.25
"""1/s, deceleration per speed, which the airframe leans against."""
ATTEMPTS = 8


@dataclass(frozen=True, slots=True)
class Phases:
    """When what begins, s: rotors, climb, cruise, descent, touch-down, rest."""

    rotors: float
    climb: float
    cruise: float
    descent: float
    touch: float
    rest: float

    def activity(self, times: Array) -> Array:
        """How hard the rotors work, 0 … 1."""
        rise = smoothstep((times - self.rotors) / 2.5)
        result: Array = rise * (1.0 - smoothstep((times - self.touch) / 1.5))
        return result

    def airborne(self, times: Array) -> Array:
        """0 on the ground, 1 in the air."""
        rise = smoothstep((times - self.climb) / 2.0)
        result: Array = rise * (1.0 - smoothstep((times - self.touch + 2.0) / 2.0))
        return result


@dataclass(frozen=True, slots=True)
class Flight:
    """Motion of the carrier's body (x forward, y left, z up) in the map.

    Attributes
    ----------
    position, yaw, pitch, roll : splines over the recording's time
    phases : when it takes off and lands
    """

    position: Spline
    yaw: Spline
    pitch: Spline
    roll: Spline
    phases: Phases

    def motion(self, times: Array) -> Motion:
        """Return the body's motion at `times`."""
        body = translating(self.position, times)
        for axis, angle in ((Z, self.yaw), (Y, self.pitch), (X, self.roll)):
            body = body.turned(axis, angle, times)
        return body

    def activity(self, times: Array) -> Array:
        """How hard the rotors work, 0 … 1."""
        return self.phases.activity(times)


def quadrotor_flight(
    world: World, rng: np.random.Generator, duration: float, ground_clearance: float, *, gusts: bool
) -> Flight:
    """Rest, take off, fly the site's route or a tour at about its speed and land where it began.

    `ground_clearance` is the height of the body's origin above the pad when standing. The tour
    keeps 0.8 m from every surface, which is verified on the final curve.
    """
    cruise = duration - 11.0 - 2.2 * _climb_time(world.site.low[2])
    for _ in range(ATTEMPTS):
        length = world.site.speed * max(cruise, 3.0)
        if world.site.route:
            tour = follow_route(world, length)
        else:
            tour = plan_tour(world, rng, length, 1.0)
        phases = _phases(rng, duration, tour.way_points[0, 2] - tour.pad[2])
        position = _position(rng, tour, phases, duration, ground_clearance)
        if gusts:
            position = _pushed(rng, position, phases)
        if _is_clear(world, position, phases):
            return with_attitude(rng, position, phases, duration)
    msg = f"no flight 0.8 m away from every surface was found in {ATTEMPTS} attempts: try another seed"
    raise UsageError(msg)


def _climb_time(height: float) -> float:
    """Slow near the ground, up to 2 m/s on a long way up."""
    return max(2.5, height / 1.2) if height < 6.0 else 5.0 + (height - 6.0) / 2.0


def _phases(rng: np.random.Generator, duration: float, height: float) -> Phases:
    rotors = rng.uniform(3.5, 5.0)
    climb = rotors + rng.uniform(2.5, 3.5)
    rise = _climb_time(height)
    touch = duration - 3.5
    phases = Phases(rotors, climb, climb + rise, touch - 1.2 * rise, touch, touch + 2.0)
    if phases.descent - phases.cruise < 2.0:
        shortest = duration + 2.0 - (phases.descent - phases.cruise)
        msg = (
            f"a flight here takes at least {np.ceil(shortest):.0f} s, {duration:g} s were asked for"
        )
        raise UsageError(msg)
    return phases


def _position(
    rng: np.random.Generator, tour: Tour, phases: Phases, duration: float, ground_clearance: float
) -> Spline:
    steps = np.linalg.norm(np.diff(tour.way_points, axis=0), axis=1)
    # Every corner costs as much time as 0.4 m of way, so that the carrier slows down there.
    costs = np.cumsum(np.concatenate([[0.0], steps + 0.4]))
    cruise = phases.cruise + costs / costs[-1] * (phases.descent - phases.cruise)
    parked = tour.pad + np.array([0.0, 0.0, ground_clearance])
    times = np.concatenate([[0.0, phases.climb], cruise, [phases.touch, duration]])
    points = np.vstack([parked, parked, tour.way_points, parked, parked])
    knots = knot_times(POSITION_STEP, duration)
    controls = np.column_stack([np.interp(knots, times, points[:, i]) for i in range(3)])
    wobble = rng.normal(0.0, WOBBLE, controls.shape) * [1.0, 1.0, 0.7]
    return Spline(POSITION_STEP, controls + wobble * phases.airborne(knots)[:, None])


def _pushed(rng: np.random.Generator, position: Spline, phases: Phases) -> Spline:
    knots = POSITION_STEP * np.arange(float(len(position.controls)))
    shifts = gust_shifts(rng, knots, phases.cruise + 1.0, phases.descent - 1.0)
    return Spline(POSITION_STEP, position.controls + shifts)


def _is_clear(world: World, position: Spline, phases: Phases) -> bool:
    times = np.arange(phases.cruise, phases.descent, 0.1)
    return bool(world.clearance(position(times)).min() > 0.8)


def with_attitude(
    rng: np.random.Generator, position: Spline, phases: Phases, duration: float
) -> Flight:
    """Let the carrier look along its way, and lean as its acceleration and drag demand."""
    yaw_knots = knot_times(YAW_STEP, duration)
    noise = rng.normal(0.0, np.radians(4.0), len(yaw_knots)) * phases.airborne(yaw_knots)
    yaw = smooth_heading(position, phases.cruise, phases.descent, duration, noise)
    knots = knot_times(ATTITUDE_STEP, duration)
    push = position(knots, 2) + DRAG * position(knots, 1)
    heading = yaw(knots)[:, 0]
    forward = np.cos(heading) * push[:, 0] + np.sin(heading) * push[:, 1]
    left = np.cos(heading) * push[:, 1] - np.sin(heading) * push[:, 0]
    lift = GRAVITY + push[:, 2]
    airborne = phases.airborne(knots)
    jitter = rng.normal(0.0, JITTER, (2, len(knots))) * airborne
    slope = rng.normal(0.0, np.radians(1.0), 2)[:, None] * (1.0 - airborne)
    pitch = np.arctan2(forward, lift) * airborne + jitter[0] + slope[0]
    roll = np.arctan2(-left, lift) * airborne + jitter[1] + slope[1]
    splines = [Spline(ATTITUDE_STEP, angle[:, None]) for angle in (pitch, roll)]
    return Flight(position, yaw, splines[0], splines[1], phases)


def smooth_heading(
    position: Spline, start: float, end: float, duration: float, noise: Array | None = None
) -> Spline:
    """Follow the way's heading slowly between `start` and `end`; constant before and after."""
    knots = knot_times(YAW_STEP, duration)
    velocity = position(np.clip(knots, start, end), 1)
    heading = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
    width = 2
    padded = np.pad(heading, width, mode="edge")
    smooth = np.convolve(padded, np.full(2 * width + 1, 1 / (2 * width + 1)), mode="valid")
    smooth = smooth if noise is None else smooth + noise
    # The spline reaches three knots ahead and back.
    on_ground = np.clip(knots, start + 3 * YAW_STEP, end - 3 * YAW_STEP)
    return Spline(YAW_STEP, np.interp(on_ground, knots, smooth)[:, None])


def smoothstep(x: Array) -> Array:
    """Rise from 0 to 1 over 0 ≤ x ≤ 1, level at both ends."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)
