# SPDX-License-Identifier: MIT OR Apache-2.0
"""A recording with truth, from a few choices and a seed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from bentwing.simulate.events import GAP, LEAD, STALL, EventName, Losses, Person, strong_bias
from bentwing.simulate.gnss import Receiver, ReceiverName
from bentwing.simulate.heads.build import build_rig
from bentwing.simulate.imu import PERFECT, Imu, ImuErrors
from bentwing.simulate.lidars.interface import LidarClock
from bentwing.simulate.ranging import Airframe, Mover, RangeErrors, Ranger
from bentwing.simulate.scenes import SCENES, World
from bentwing.simulate.stream import Sensors
from bentwing.simulate.write import SimulatedRecording, write_recording

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bentwing.simulate.rig import Rig

SceneName = Literal[
    "courtyard", "compound", "office", "forest", "cave", "mine", "town", "walls", "dam",
    "mocap", "carpark", "campus",
]  # fmt: skip
HeadName = Literal["hokuyo-spin", "hokuyo-nod", "vlp16-fixed", "vlp16-side", "vlp16-motor"]
SpinName = Literal["steady", "plant"]
FlightName = Literal["tour", "survey", "stand"]
Format = Literal["bag", "mcap", "db3"]
_SURVEYED = ("walls", "dam")


class Scenario(BaseModel):
    """What to simulate.

    Attributes
    ----------
    scene : name of the world
    head : sensor head and how it is moved; by default `hokuyo-spin`, for a town `vlp16-motor`
    duration : s
    seed : varies geometry, motion, calibration and noise
    flight_seed : varies all of that but the geometry: another flight in the world of `seed`; by
        default `seed`
    format : of the recording: a ROS 1 bag, or a ROS 2 folder with mcap or sqlite storage
    motor_rate : rad/s, of a motor-turned head
    spin : of `hokuyo-spin`: a `steady` rate that wanders a little, or driven by the simulated `plant`
        of downdraft, vanes and controller
    max_range : m, beyond it the lidar sees nothing; by default what the sensor can do
    speed : m/s, at about which a tour is flown; by default what suits the scene
    events : what goes wrong
    stall : s, how long the head does not turn in the event `spin-stall`
    gnss : a receiver, `rtk` or `single`; by default there is none
    flight : a tour from the ground and back, the site's line in the air (town, walls, dam), or none:
        the head on a stand
    calibrated : whether the payload has the head as it is, and the clocks agree
    noiseless : without random errors of the sensors (calibration and clock stay wrong)
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    scene: SceneName
    head: HeadName = "hokuyo-spin"
    duration: float = Field(default=60.0, gt=0.0, le=3600.0)
    seed: int = Field(default=0, ge=0)
    flight_seed: int | None = Field(default=None, ge=0)
    format: Format = "bag"
    motor_rate: float = Field(default=1.0, gt=0.0, le=10.0)
    spin: SpinName = "steady"
    max_range: float | None = Field(default=None, gt=1.0)
    speed: float | None = Field(default=None, gt=0.1, le=5.0)
    events: tuple[EventName, ...] = ()
    stall: float = Field(default=STALL, gt=0.0, le=60.0)
    gnss: ReceiverName | None = None
    flight: FlightName = "tour"
    calibrated: bool = False
    noiseless: bool = False

    @model_validator(mode="before")
    @classmethod
    def _choose_head(cls, values: dict[str, Any]) -> dict[str, Any]:
        """From 30 m above, a town is out of a Hokuyo's reach; walls and dam have but a survey."""
        scene = values.get("scene")
        far = scene in {"town", *_SURVEYED}
        chosen = {"head": "vlp16-motor" if far else "hokuyo-spin"}
        chosen["flight"] = "survey" if scene in _SURVEYED else "tour"
        return {**values, **{k: v for k, v in chosen.items() if values.get(k) is None}}

    @model_validator(mode="after")
    def _can_be_flown(self) -> Scenario:
        if self.flight == "stand" and self.head == "hokuyo-nod":
            msg = "hokuyo-nod is carried on foot and stands nowhere: choose another head"
            raise ValueError(msg)
        if (self.flight == "survey") != (self.scene in _SURVEYED) and self.scene != "town":
            only = "survey" if self.scene in _SURVEYED else "tour"
            msg = f"a {self.scene} has no {self.flight}: choose {only}"
            raise ValueError(msg)
        if self.flight == "survey" and self.head == "hokuyo-nod":
            msg = "hokuyo-nod is carried on foot and flies no survey: choose another head"
            raise ValueError(msg)
        return self

    def imu_errors(self) -> ImuErrors:
        """Errors of the IMU."""
        if self.noiseless:
            return PERFECT
        return strong_bias(ImuErrors()) if "strong-bias" in self.events else ImuErrors()

    def range_errors(self, sigma: float) -> RangeErrors:
        """Errors of a lidar with range noise `sigma` (m)."""
        if self.noiseless:
            return RangeErrors(0.0, resolution=0.0, dropout=0.0, mixing=0.0)
        return RangeErrors(sigma)

    def rng(self, purpose: str) -> np.random.Generator:
        """Random numbers that depend on the seed and on what they are for."""
        of_world = purpose == "scene" or self.flight_seed is None
        return np.random.default_rng(
            [self.seed if of_world else self.flight_seed, *purpose.encode()]
        )


@dataclass(frozen=True, slots=True)
class Setup:
    """A scenario ready to be recorded.

    Attributes
    ----------
    first, last : s, what of the rig's motion is recorded
    """

    world: World
    rig: Rig
    sensors: Sensors
    first: float
    last: float


def prepare(scenario: Scenario) -> Setup:
    """Build the world, plan the motion and hang the sensors on it."""
    first = LEAD if "motion-start" in scenario.events else 0.0
    last = first + scenario.duration
    site = SCENES[scenario.scene](scenario.rng("scene"))
    world = World(site if scenario.speed is None else replace(site, speed=scenario.speed))
    rig = build_rig(scenario, world, last)
    rng = scenario.rng("lidar")
    latency = float(rng.uniform(0.001, 0.004) * rng.choice([-1.0, 1.0]))
    exact = scenario.noiseless or scenario.calibrated
    clock = LidarClock(0.0 if scenario.calibrated else latency, 0.0 if exact else 1e-4)
    imu = Imu(scenario.imu_errors(), scenario.rng("imu"), rig.carrier.activity)
    ranger = Ranger(
        world,
        rig,
        scenario.range_errors(rig.head.lidar.noise),
        rig.head.lidar.max_range,
        _movers(scenario, world, rig, 0.5 * (first + last)),
        rng,
    )
    receiver = None
    if scenario.gnss is not None:
        receiver = Receiver(scenario.gnss, scenario.rng("gnss"), rig.imu, scenario.noiseless)
    sensors = Sensors(rig, ranger, imu, clock, _losses(scenario, first, last), rng, receiver)
    return Setup(world, rig, sensors, first, last)


def _movers(scenario: Scenario, world: World, rig: Rig, middle: float) -> list[Mover]:
    movers: list[Mover] = [Airframe(rig.head.airframe, rig)]
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
