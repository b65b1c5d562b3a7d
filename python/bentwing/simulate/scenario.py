# SPDX-License-Identifier: MIT OR Apache-2.0
"""A recording with truth, from a few choices and a seed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from bentwing.simulate.heads.build import build_rig
from bentwing.simulate.imu import PERFECT, Imu, ImuErrors
from bentwing.simulate.lidars.interface import LidarClock
from bentwing.simulate.ranging import Airframe, RangeErrors, Ranger
from bentwing.simulate.scenes import SCENES, World
from bentwing.simulate.stream import Sensors
from bentwing.simulate.write import SimulatedRecording, write_recording

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bentwing.simulate.rig import Rig

SceneName = Literal["courtyard", "office", "forest", "cave", "mine", "town"]
HeadName = Literal["hokuyo-spin", "hokuyo-nod", "vlp16-fixed", "vlp16-motor"]
Format = Literal["bag", "mcap", "db3"]


class Scenario(BaseModel):
    """What to simulate.

    Attributes
    ----------
    scene : name of the world
    head : sensor head and how it is moved
    duration : s
    seed : varies geometry, motion, calibration and noise
    format : of the recording: a ROS 1 bag, or a ROS 2 folder with mcap or sqlite storage
    motor_rate : rad/s, of a motor-turned head
    max_range : m, beyond it the lidar sees nothing; by default what the sensor can do
    noiseless : without random errors of the sensors (calibration and clock stay wrong)
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    scene: SceneName
    head: HeadName = "hokuyo-spin"
    duration: float = Field(default=60.0, gt=0.0, le=3600.0)
    seed: int = Field(default=0, ge=0)
    format: Format = "bag"
    motor_rate: float = Field(default=1.0, gt=0.0, le=10.0)
    max_range: float | None = Field(default=None, gt=1.0)
    noiseless: bool = False

    def rng(self, purpose: str) -> np.random.Generator:
        """Random numbers that depend on the seed and on what they are for."""
        return np.random.default_rng([self.seed, *purpose.encode()])


@dataclass(frozen=True, slots=True)
class Setup:
    """A scenario ready to be recorded."""

    world: World
    rig: Rig
    sensors: Sensors


def prepare(scenario: Scenario) -> Setup:
    """Builds the world, plans the flight and hangs the sensors on it."""
    world = World(SCENES[scenario.scene](scenario.rng("scene")))
    rig = build_rig(scenario, world)
    lidar, rng = rig.head.lidar, scenario.rng("lidar")
    errors = RangeErrors(lidar.noise)
    if scenario.noiseless:
        errors = RangeErrors(0.0, resolution=0.0, dropout=0.0, mixing=0.0)
    ranger = Ranger(world, rig, errors, lidar.max_range, [Airframe(rig.head.airframe, rig)], rng)
    imu_errors = PERFECT if scenario.noiseless else ImuErrors()
    imu = Imu(imu_errors, scenario.rng("imu"), rig.carrier.activity)
    latency = float(rng.uniform(0.001, 0.004) * rng.choice([-1.0, 1.0]))
    clock = LidarClock(latency, 0.0 if scenario.noiseless else 1e-4)
    return Setup(world, rig, Sensors(rig, ranger, imu, clock, rng))


def simulate(
    scenario: Scenario, out: Path, progress: Callable[[float], None] | None = None
) -> SimulatedRecording:
    """Writes the recording, its `payload.yaml` and the truth into the folder `out`.

    Parameters
    ----------
    progress : called with the simulated time in s, about once per simulated second

    Raises
    ------
    UsageError
        if `out` already holds a recording, or no flight of this duration is possible
    """
    return write_recording(prepare(scenario), scenario, out, progress)
