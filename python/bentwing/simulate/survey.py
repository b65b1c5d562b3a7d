# SPDX-License-Identifier: MIT OR Apache-2.0
"""A flight along a line that begins and ends in the air, and none at all."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.planner import free_points
from bentwing.simulate.splines import Spline, knot_times
from bentwing.simulate.trajectories import (
    ATTITUDE_STEP,
    POSITION_STEP,
    WOBBLE,
    YAW_STEP,
    Flight,
    Phases,
    with_attitude,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.scenes import Survey, World

HOVER = 2.0
"""s, before the flight along the line begins."""
STAND_CLEARANCE = 1.0
"""m, from a head on a stand to the nearest surface."""
SLOPE = np.radians(1.0)
"""Standard deviation of a stand's tilt."""
FOREVER = 1e6


def survey_flight(survey: Survey, rng: np.random.Generator, duration: float) -> Flight:
    """Hover for `HOVER` s, fly along the line at its speed, and hover at its end.

    A survey of a single point stands perfectly still.
    """
    points = np.array(survey.way_points)
    if len(points) == 1:
        return _still(points[0], (0.0, survey.pitch, 0.0))
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    arrival = HOVER + way[-1] / survey.speed
    knots = knot_times(POSITION_STEP, duration)
    at = np.clip((knots - HOVER) * survey.speed, 0.0, way[-1])
    controls = np.column_stack([np.interp(at, way, points[:, i]) for i in range(3)])
    wobble = rng.normal(0.0, WOBBLE, controls.shape) * [1.0, 1.0, 0.7]
    in_air = Phases(-FOREVER, -FOREVER, HOVER, min(arrival, duration), FOREVER, FOREVER)
    return with_attitude(rng, Spline(POSITION_STEP, controls + wobble), in_air, duration)


def standing(world: World, rng: np.random.Generator) -> Flight:
    """Stand perfectly still on a stand somewhere in the world, about level."""
    at = free_points(world, rng, STAND_CLEARANCE)[0]
    tilt = rng.normal(0.0, SLOPE, 2)
    return _still(at, (rng.uniform(0.0, 2 * np.pi), tilt[0], tilt[1]))


def _still(
    point: tuple[float, ...] | NDArray[np.float64], turned: tuple[float, float, float]
) -> Flight:
    """Stay at a point, turned by yaw, pitch and roll."""
    yaw, pitch, roll = (np.full((1, 1), angle) for angle in turned)
    at_rest = Phases(FOREVER, FOREVER, FOREVER, FOREVER, FOREVER, FOREVER)
    return Flight(
        Spline(POSITION_STEP, np.array(point)[None]),
        Spline(YAW_STEP, yaw),
        Spline(ATTITUDE_STEP, pitch),
        Spline(ATTITUDE_STEP, roll),
        at_rest,
    )
