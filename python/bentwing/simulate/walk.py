# SPDX-License-Identifier: MIT OR Apache-2.0
"""A person who walks through a scene with a handheld head."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.simulate.heads.rates import ornstein_uhlenbeck
from bentwing.simulate.kinematics import Motion, translating
from bentwing.simulate.planner import Tour, plan_tour
from bentwing.simulate.splines import Spline, knot_times
from bentwing.simulate.trajectories import ATTEMPTS, Y, Z, smooth_heading, smoothstep

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.scenes import World

    Array = NDArray[np.float64]

STEP = 0.05
STEPS_HZ = 1.9
SPEED = 0.8
CLEARANCE = 0.55
HEIGHTS = (1.1, 1.25)
"""m, of the hand above the ground."""


@dataclass(frozen=True, slots=True)
class Walk:
    """Motion of the hand (x ahead, z up): way, gait and sway.

    Attributes
    ----------
    start, end : s, when walking begins and ends; before and after, the head rests
    """

    position: Spline
    yaw: Spline
    sway: Spline
    start: float
    end: float

    def motion(self, times: Array) -> Motion:
        """Return the hand's motion at `times`."""
        return (
            translating(self.position, times).turned(Z, self.yaw, times).turned(Y, self.sway, times)
        )

    def walking(self, times: Array) -> Array:
        """0 at rest, 1 when walking."""
        rise = smoothstep((times - self.start) / 1.5)
        result: Array = rise * smoothstep((self.end - times) / 1.5)
        return result

    def activity(self, times: Array) -> Array:
        """Nothing vibrates: there are no rotors."""
        return np.zeros(len(times))


def walk(world: World, rng: np.random.Generator, duration: float) -> Walk:
    """Rest for about 4 s, then walk a tour, 0.45 m from every surface."""
    for _ in range(ATTEMPTS):
        start, end = rng.uniform(3.5, 4.5), duration - 1.5
        if end - start < 4.0:
            msg = f"a walk takes at least 10 s, {duration:g} s were asked for"
            raise UsageError(msg)
        tour = plan_tour(world, rng, SPEED * (end - start - 2.0), CLEARANCE, HEIGHTS)
        position = _position(rng, tour, start, end, duration)
        inside = np.arange(start, end, 0.1)
        if world.clearance(position(inside)).min() > CLEARANCE - 0.1:
            break
    else:
        msg = f"no free way was found in {ATTEMPTS} attempts: try another seed"
        raise UsageError(msg)
    yaw = smooth_heading(position, start + 1.0, end - 1.0, duration)
    knots = knot_times(STEP, duration)
    drift = np.radians(ornstein_uhlenbeck(rng, len(knots), STEP, 0.4, 2.5))
    resting = Walk(position, yaw, Spline(STEP, drift[:, None]), start, end)
    sway = Spline(STEP, (drift * resting.walking(knots))[:, None])
    return Walk(position, yaw, sway, start, end)


def _position(
    rng: np.random.Generator, tour: Tour, start: float, end: float, duration: float
) -> Spline:
    """Return the tour, evenly walked and rounded over a second, with the gait on top."""
    lengths = np.linalg.norm(np.diff(tour.way_points, axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(lengths)])
    knots = knot_times(STEP, duration)
    share = np.clip((knots - start - 1.0) / (end - start - 2.0), 0.0, 1.0)
    points = np.column_stack([np.interp(share * way[-1], way, c) for c in tour.way_points.T])
    width = 20
    padded = np.pad(points, ((width, width), (0, 0)), mode="edge")
    window = np.hanning(2 * width + 3)[1:-1]
    smooth = np.column_stack(
        [np.convolve(c, window / window.sum(), mode="valid") for c in padded.T]
    )
    envelope = smoothstep((knots - start) / 1.5) * smoothstep((end - knots) / 1.5)
    phase = 2 * np.pi * STEPS_HZ * knots + 0.3 * ornstein_uhlenbeck(rng, len(knots), STEP, 2.0, 1.0)
    smooth[:, 2] += 0.02 * envelope * np.sin(phase)
    smooth[:, :2] += 0.012 * envelope[:, None] * np.sin(phase / 2)[:, None] * [0.7, 0.7]
    return Spline(STEP, smooth)
