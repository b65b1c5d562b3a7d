# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a scenario's head to the rig that carries it through the world."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.drive import drive
from bentwing.simulate.events import reversing, turning
from bentwing.simulate.heads.airframe import LEG_LENGTH
from bentwing.simulate.heads.car import car_head
from bentwing.simulate.heads.hokuyo_nod import NOD_STEP, hokuyo_nod
from bentwing.simulate.heads.hokuyo_spin import hokuyo_spin
from bentwing.simulate.heads.rates import SPIN_STEP, spin_angle, spin_drive
from bentwing.simulate.heads.vlp16 import MOTOR_STEP, vlp16_fixed, vlp16_motor, vlp16_side
from bentwing.simulate.lidars.hdl64 import hdl64
from bentwing.simulate.lidars.os1 import os1_64
from bentwing.simulate.names import CAR_HEADS
from bentwing.simulate.plant.profile import driven_spin, flight_air
from bentwing.simulate.rig import Head, Rig
from bentwing.simulate.splines import knot_times
from bentwing.simulate.survey import standing, survey_flight
from bentwing.simulate.trajectories import Flight, quadrotor_flight
from bentwing.simulate.walk import walk

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.scenario import Scenario
    from bentwing.simulate.scenes import World

    Array = NDArray[np.float64]

HOKUYO_RANGE, VLP16_RANGE, CAR_RANGE = 30.0, 100.0, 100.0


def build_rig(scenario: Scenario, world: World, duration: float) -> Rig:
    """Carry the scenario's head through `world` for `duration` s."""
    rng = scenario.rng("head")
    if scenario.head == "hokuyo-nod":
        return _nodding(scenario, world, rng, duration)
    if scenario.head in CAR_HEADS:
        return _driving(scenario, world, rng, duration)
    flight = _flight(scenario, world, duration)
    if scenario.head == "hokuyo-spin":
        return Rig(flight, _spun(scenario, flight, rng, duration))
    max_range = scenario.max_range or VLP16_RANGE
    doubt = scenario.doubt()
    if scenario.head == "vlp16-fixed":
        return Rig(flight, vlp16_fixed(rng, max_range, doubt))
    if scenario.head == "vlp16-side":
        return Rig(flight, vlp16_side(rng, max_range, doubt))
    drive = _drive(scenario, MOTOR_STEP, duration)
    if "motor-reversal" in scenario.events:
        drive = drive * reversing(knot_times(MOTOR_STEP, duration), duration)
    return Rig(flight, vlp16_motor(rng, scenario.motor_rate, drive, max_range, doubt))


def _flight(scenario: Scenario, world: World, duration: float) -> Flight:
    rng, survey = scenario.rng("flight"), world.site.survey
    if scenario.flight == "stand":
        return standing(world, rng)
    if scenario.flight == "survey" and survey is not None:
        return survey_flight(survey, rng, duration)
    gusts = "gusts" in scenario.events
    return quadrotor_flight(world, rng, duration, LEG_LENGTH, gusts=gusts)


def _spun(scenario: Scenario, flight: Flight, rng: np.random.Generator, duration: float) -> Head:
    drive = spin_drive(flight.activity(knot_times(SPIN_STEP, duration)))
    mean = np.radians(rng.uniform(220.0, 320.0))
    turning = _drive(scenario, SPIN_STEP, duration)
    if scenario.spin == "plant":
        air = flight_air(flight, duration, scenario.rng("air"), gusts="gusts" in scenario.events)
        spin = driven_spin(air, mean, scenario.rng("spin"), turning)
    else:
        spin = spin_angle(rng, mean, drive * turning)
    return hokuyo_spin(rng, spin, scenario.max_range or HOKUYO_RANGE, scenario.doubt())


def _driving(scenario: Scenario, world: World, rng: np.random.Generator, duration: float) -> Rig:
    carrier = drive(world, scenario.rng("drive"), duration)
    max_range = scenario.max_range or CAR_RANGE
    if scenario.head == "hdl64":
        head = car_head(rng, hdl64(max_range), "generic", scenario.doubt())
    else:
        head = car_head(rng, os1_64(max_range), "ouster", scenario.doubt())
    return Rig(carrier, head)


def _nodding(scenario: Scenario, world: World, rng: np.random.Generator, duration: float) -> Rig:
    carrier = walk(world, scenario.rng("walk"), duration)
    walking = carrier.walking(knot_times(NOD_STEP, duration))
    drive = walking * _drive(scenario, NOD_STEP, duration)
    max_range = scenario.max_range or HOKUYO_RANGE
    return Rig(carrier, hokuyo_nod(rng, drive, max_range, scenario.doubt()))


def _drive(scenario: Scenario, step: float, duration: float) -> Array:
    """How much the head is driven at the knots of its angle, 0 … 1."""
    knots = knot_times(step, duration)
    stalls = "spin-stall" in scenario.events
    return turning(knots, duration, scenario.stall) if stalls else np.ones(len(knots))
