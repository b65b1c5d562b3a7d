# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a scenario's head to the rig that carries it through the world."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.heads.airframe import LEG_LENGTH
from bentwing.simulate.heads.hokuyo_nod import NOD_STEP, hokuyo_nod
from bentwing.simulate.heads.hokuyo_spin import hokuyo_spin
from bentwing.simulate.heads.rates import SPIN_STEP, spin_angle, spin_drive
from bentwing.simulate.heads.vlp16 import vlp16_fixed, vlp16_motor
from bentwing.simulate.rig import Rig
from bentwing.simulate.splines import knot_times
from bentwing.simulate.trajectories import Flight, quadrotor_flight
from bentwing.simulate.walk import walk

if TYPE_CHECKING:
    from bentwing.simulate.scenario import Scenario
    from bentwing.simulate.scenes import World

HOKUYO_RANGE, VLP16_RANGE = 30.0, 100.0


def build_rig(scenario: Scenario, world: World) -> Rig:
    """Carry the scenario's head through `world`."""
    match scenario.head:
        case "hokuyo-spin":
            return _spun(scenario, world)
        case "hokuyo-nod":
            return _nodding(scenario, world)
        case "vlp16-fixed":
            max_range = scenario.max_range or VLP16_RANGE
            return Rig(_flight(scenario, world), vlp16_fixed(scenario.rng("head"), max_range))
        case "vlp16-motor":
            max_range = scenario.max_range or VLP16_RANGE
            rate, duration = scenario.motor_rate, scenario.duration
            head = vlp16_motor(scenario.rng("head"), rate, duration, max_range)
            return Rig(_flight(scenario, world), head)


def _flight(scenario: Scenario, world: World) -> Flight:
    rng, speed = scenario.rng("flight"), world.site.speed
    return quadrotor_flight(world, rng, scenario.duration, speed, LEG_LENGTH)


def _spun(scenario: Scenario, world: World) -> Rig:
    rng, flight = scenario.rng("head"), _flight(scenario, world)
    drive = spin_drive(flight.activity(knot_times(SPIN_STEP, scenario.duration)))
    mean = np.radians(rng.uniform(220.0, 320.0))
    spin = spin_angle(rng, mean, drive, scenario.duration)
    return Rig(flight, hokuyo_spin(rng, spin, scenario.max_range or HOKUYO_RANGE))


def _nodding(scenario: Scenario, world: World) -> Rig:
    carrier = walk(world, scenario.rng("walk"), scenario.duration)
    walking = carrier.walking(knot_times(NOD_STEP, scenario.duration))
    max_range = scenario.max_range or HOKUYO_RANGE
    return Rig(carrier, hokuyo_nod(scenario.rng("head"), walking, scenario.duration, max_range))
