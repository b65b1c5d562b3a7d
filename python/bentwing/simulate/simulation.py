# SPDX-License-Identifier: MIT OR Apache-2.0
"""A recording with truth: from a scenario to a world, a rig and its sensors, and to the files."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.events import GAP, LEAD, Losses, Person
from bentwing.simulate.gnss import Place, Receiver
from bentwing.simulate.heads.build import build_rig
from bentwing.simulate.imu import Imu
from bentwing.simulate.lidars.interface import LidarClock
from bentwing.simulate.ranging import Airframe, Body, Ranger
from bentwing.simulate.realism.draw import Realism
from bentwing.simulate.scenes import SCENES, World
from bentwing.simulate.scenes.boxes import with_boxes
from bentwing.simulate.scenes.spheres import with_spheres
from bentwing.simulate.setup import Setup
from bentwing.simulate.stream import Sensors
from bentwing.simulate.write import SimulatedRecording, write_recording

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bentwing.simulate.rig import Rig
    from bentwing.simulate.scenario import Scenario
    from bentwing.simulate.scenes import Site


def prepare(scenario: Scenario) -> Setup:
    """Build the world, plan the motion and hang the sensors on it."""
    first = LEAD if "motion-start" in scenario.events else 0.0
    last = first + scenario.duration
    world = World(_site(scenario))
    realism = Realism(scenario, last)
    rig = realism.rig(build_rig(scenario, world, last))
    rng = scenario.rng("lidar")
    latency = float(rng.uniform(0.001, 0.004) * rng.choice([-1.0, 1.0]))
    doubt = scenario.doubt()
    exact = scenario.noiseless or scenario.calibrated
    clock = LidarClock(latency * doubt if doubt else 0.0, 0.0 if exact else 1e-4)
    imu = Imu(
        scenario.imu_errors(),
        scenario.rng("imu"),
        rig.carrier.activity,
        realism.response(),
        realism.shocks(),
    )
    lidar = rig.head.lidar
    bodies = realism.bodies(world, lidar.max_range)
    bodies += _movers(scenario, world, rig, 0.5 * (first + last))
    errors, beams = scenario.range_errors(lidar.noise), realism.beams(lidar)
    ranger = Ranger(bodies, rig, errors, lidar.max_range, rng, beams, realism.ranges(beams))
    receiver = None
    if scenario.gnss is not None:
        place = Place.draw(scenario.rng("place"))
        errors_of = scenario.rng("gnss")
        receiver = Receiver(scenario.gnss, place, errors_of, rig.imu, scenario.noiseless)
    losses = _losses(scenario, first, last)
    host, samples = realism.host(), realism.samples(rig)
    sensors = Sensors(rig, ranger, imu, clock, losses, rng, receiver, host, samples)
    return Setup(world, rig, sensors, first, last, realism)


def _site(scenario: Scenario) -> Site:
    """Build the scene, and stand in it what a flight finds there."""
    furnished = {} if scenario.things_seed is None else {"things": scenario.rng("things")}
    site = SCENES[scenario.scene](scenario.rng("scene"), **furnished)
    if scenario.boxes:
        spots = scenario.rng("where boxes stand")
        site = with_boxes(site, scenario.boxes, scenario.rng("boxes"), spots)
    if scenario.spheres:
        site = with_spheres(site, scenario.spheres, scenario.rng("spheres"))
    return site if scenario.speed is None else replace(site, speed=scenario.speed)


def _movers(scenario: Scenario, world: World, rig: Rig, middle: float) -> list[Body]:
    movers: list[Body] = [Airframe(rig.head.airframe, rig)]
    if "person" in scenario.events:
        near = rig.imu(np.array([middle])).p[0]
        movers.append(Person(world, scenario.rng("person"), near))
    return movers


def _losses(scenario: Scenario, first: float, last: float) -> Losses:
    at = first + 0.6 * (last - first)
    gap = (at, at + GAP) if "gap" in scenario.events else None
    return Losses(scenario.rng("losses"), gap, bursts="dropped-packets" in scenario.events)


def simulate(
    scenario: Scenario, out: Path, progress: Callable[[float], None] | None = None
) -> SimulatedRecording:
    """Write the recording, its `payload.yaml` and the truth into the folder `out`.

    Parameters
    ----------
    progress : called with the simulated time in s, about once per simulated second

    Raises
    ------
    UsageError
        if `out` already holds a recording, or no flight of this duration is possible
    """
    return write_recording(prepare(scenario), scenario, out, progress)
