# SPDX-License-Identifier: MIT OR Apache-2.0
"""What to simulate: a few choices and a seed."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import Field, model_validator

from bentwing.base.settings import Settings
from bentwing.simulate.events import STALL, strong_bias
from bentwing.simulate.imu import PERFECT, ImuErrors
from bentwing.simulate.names import (
    CAR_HEADS,
    EventName,
    FlightName,
    HeadName,
    RealismGroup,
    ReceiverName,
    RecordingFormat,
    SceneName,
    SpinName,
)
from bentwing.simulate.ranging import RangeErrors

_SURVEYED = ("walls", "dam")
_DRIVEN = ("street",)
_FURNISHED = ("courtyard", "office", "carpark")
FASTEST_TOUR = 5.0
"""m/s."""


class Scenario(Settings):
    """What to simulate.

    Attributes
    ----------
    scene : name of the world
    head : sensor head and how it is moved; by default `hokuyo-spin`, for a town `vlp16-motor`, for a
        street `hdl64`
    duration : s
    seed : varies geometry, motion, calibration and noise
    flight_seed : varies all of that but the geometry: another flight in the world of `seed`; by
        default `seed`
    things_seed : varies what stands in a `courtyard`, `office` or `carpark`, and neither walls nor pillars:
        another storey that is built alike; by default `seed` does
    boxes : that stand on the free ground of a tour, each flight's elsewhere: another day in the world of `seed`
    spheres : of 0.1 m radius that stand on posts as control marks, the same in all flights of a world
    format : of the recording: a ROS 1 bag, or a ROS 2 folder with mcap or sqlite storage
    motor_rate : rad/s, of a motor-turned head
    spin : of `hokuyo-spin`: a `steady` rate that wanders a little, or driven by the simulated `plant`
        of downdraft, vanes and controller
    max_range : m, beyond it the lidar sees nothing; by default what the sensor can do
    speed : m/s, at about which a tour is flown or a road driven; by default what suits the scene
    events : what goes wrong
    stall : s, how long the head does not turn in the event `spin-stall`
    gnss : a receiver, `rtk` or `single`; by default there is none
    flight : a tour from the ground and back, the site's line in the air (town, walls, dam), a drive
        along its road (street), or none: the head on a stand
    realism : size of the errors that real sensors have beyond noise: 0 for none, 1 for what is
        usual, 3 for three times that
    realism_only : groups of these errors; by default all
    calibrated : whether the payload has the head as it is, and the clocks agree
    noiseless : without random errors of the sensors (calibration and clock stay wrong)
    """

    scene: SceneName
    head: HeadName = "hokuyo-spin"
    duration: float = Field(default=60.0, gt=0.0, le=3600.0)
    seed: int = Field(default=0, ge=0, le=2**63 - 1)
    flight_seed: int | None = Field(default=None, ge=0, le=2**63 - 1)
    things_seed: int | None = Field(default=None, ge=0, le=2**63 - 1)
    boxes: int = Field(default=0, ge=0, le=100)
    spheres: int = Field(default=0, ge=0, le=20)
    format: RecordingFormat = "bag"
    motor_rate: float = Field(default=1.0, gt=0.0, le=10.0)
    spin: SpinName = "steady"
    max_range: float | None = Field(default=None, gt=1.0, le=10_000.0)
    speed: float | None = Field(default=None, gt=0.1, le=20.0)
    events: tuple[EventName, ...] = ()
    stall: float = Field(default=STALL, gt=0.0, le=60.0)
    gnss: ReceiverName | None = None
    flight: FlightName = "tour"
    realism: float = Field(default=0.0, ge=0.0, le=3.0)
    realism_only: tuple[RealismGroup, ...] = ()
    calibrated: bool = False
    noiseless: bool = False

    @model_validator(mode="before")
    @classmethod
    def _choose_head(cls, values: dict[str, Any]) -> dict[str, Any]:
        """From 30 m above, a town is out of a Hokuyo's reach; walls and dam have but a survey; a car drives."""
        scene = values.get("scene")
        far = scene in {"town", *_SURVEYED}
        chosen = {"head": "vlp16-motor" if far else "hokuyo-spin"}
        chosen["flight"] = "survey" if scene in _SURVEYED else "tour"
        if scene in _DRIVEN:
            chosen = {"head": "hdl64", "flight": "drive"}
        return {**values, **{k: v for k, v in chosen.items() if values.get(k) is None}}

    @model_validator(mode="after")
    def _groups_have_a_size(self) -> Scenario:
        if self.realism_only and not self.realism:
            msg = "realism_only chooses groups of errors that have no size: give realism as well"
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _has_things(self) -> Scenario:
        if self.things_seed is not None and self.scene not in _FURNISHED:
            msg = f"things_seed: only {', '.join(_FURNISHED)} can be furnished in another way"
            raise ValueError(msg)
        for name in ("boxes", "spheres"):
            if getattr(self, name) and self.flight not in ("tour", "stand"):
                msg = f"{name}: none are seen from a {self.flight}; they stand on the ground of a tour"
                raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _can_be_driven(self) -> Scenario:
        asked = [self.scene in _DRIVEN, self.flight == "drive", self.head in CAR_HEADS]
        if any(asked) and not all(asked):
            msg = f"a car with a head of {' or '.join(CAR_HEADS)} drives, and only in a street"
            raise ValueError(msg)
        if self.speed is not None and self.speed > FASTEST_TOUR and self.flight != "drive":
            msg = f"speed: at most {FASTEST_TOUR:g} m/s in a tour, {self.speed:g} were asked for"
            raise ValueError(msg)
        return self

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
        # Beams that have a width need no mixing by chance.
        return RangeErrors(sigma, mixing=0.0) if self.realism_of("ranges") else RangeErrors(sigma)

    def realism_of(self, group: RealismGroup) -> float:
        """Return the size of one group of real sensors' errors."""
        return self.realism if not self.realism_only or group in self.realism_only else 0.0

    def doubt(self) -> float:
        """Return how wrong the payload is, against the usual."""
        return 0.0 if self.calibrated else max(1.0, self.realism_of("payload"))

    def rng(self, purpose: str) -> np.random.Generator:
        """Random numbers that depend on the seed and on what they are for."""
        of_world = purpose in ("scene", "place", "boxes", "spheres") or self.flight_seed is None
        seed = self.seed if of_world else self.flight_seed
        if purpose == "things":
            seed = self.things_seed
        return np.random.default_rng([seed, *purpose.encode()])
