# SPDX-License-Identifier: MIT OR Apache-2.0
"""Two walls at a right angle, 10 m from a lidar that stays where it is (Tazir 2020, figure 5)."""

from __future__ import annotations

import numpy as np

from bentwing.simulate.scenes.mesh import merge, quad
from bentwing.simulate.scenes.world import Site, Survey

DISTANCE = 10.0
"""m, from the lidar to each of the walls."""
HALF, TOP = 10.0, 12.0


def walls(_rng: np.random.Generator) -> Site:
    """Build the wall x = 10 m, which the motor's axis meets squarely, and y = 10 m, parallel to it."""
    d, h, top = DISTANCE, HALF, TOP
    across = quad([(d, h, 0), (d, -h, 0), (d, -h, top), (d, h, top)])
    along = quad([(-h, d, 0), (h, d, 0), (h, d, top), (-h, d, top)])
    floor = quad([(-h, -h, 0), (d, -h, 0), (d, d, 0), (-h, d, 0)])
    # The axis of a motor-turned lidar is the carrier's vertical: pitched so, it lies along x.
    survey = Survey(((0.0, 0.0, 5.0),), speed=0.0, pitch=float(np.pi / 2))
    return Site(merge([across, along, floor]), (-h, -h, 0.0), (d, d, top), 0.5, 0.0, survey)
