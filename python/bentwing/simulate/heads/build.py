# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a scenario's head to the rig that carries it through the world."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.heads.airframe import LEG_LENGTH
from bentwing.simulate.heads.hokuyo_spin import hokuyo_spin
from bentwing.simulate.heads.rates import SPIN_STEP, spin_angle, spin_drive
from bentwing.simulate.rig import Rig
from bentwing.simulate.splines import knot_times
from bentwing.simulate.trajectories import quadrotor_flight

if TYPE_CHECKING:
    from bentwing.simulate.scenario import Scenario
    from bentwing.simulate.scenes import World

HOKUYO_RANGE = 30.0


def build_rig(scenario: Scenario, world: World) -> Rig:
    """The carrier's flight through `world` with the scenario's head."""
    rng = scenario.rng("head")
    speed = world.site.speed
    flight = quadrotor_flight(
        world, scenario.rng("flight"), scenario.duration, speed, LEG_LENGTH
    )
    drive = spin_drive(flight.activity(knot_times(SPIN_STEP, scenario.duration)))
    spin = spin_angle(rng, np.radians(rng.uniform(220.0, 320.0)), drive, scenario.duration)
    return Rig(flight, hokuyo_spin(rng, spin, scenario.max_range or HOKUYO_RANGE))
