# SPDX-License-Identifier: MIT OR Apache-2.0
"""Closed-loop runs: the pilot pushes against structure, drifts in wind, flies at a door."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from bentwing.flight.control import BumperSettings, VirtualBumper
from bentwing.simulate.heads.rates import ornstein_uhlenbeck
from bentwing.simulate.push.places import PLACES, free_start, hull_clearance
from bentwing.simulate.push.quadrotor import Quadrotor, QuadrotorSettings
from bentwing.simulate.push.sensing import believed, scan
from bentwing.simulate.scenes import World

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

PlaceName = Literal["office", "cave", "forest", "door"]
PilotName = Literal["push", "drift"]

PERIOD = 0.02
"""s; the bumper takes two sweeps of the Hokuyo and commands at 50 Hz."""
SUBSTEPS = 2
TIMED_EVERY = 5
"""Commands; reading the thread's clock takes time itself."""
WARM_UP = 1.0
"""s of hovering in which the grid fills, as before any flight."""
MAX_STICK = np.radians(15.0)
MAX_SPEED = 2.0
"""m/s; the pilot eases off beyond it."""
_PILOT_GAIN = 0.25  # rad per m/s of missing speed


@dataclass(frozen=True, slots=True)
class PushRun:
    """What is flown.

    Attributes
    ----------
    place : where
    pilot : `push` holds a course at up to 2 m/s whatever is in the way, `drift` leaves the stick alone
    seed : place, course, wind and noise
    duration : s, from the end of the warm-up
    max_wind : m/s
    with_bumper : whether the bumper acts
    """

    place: PlaceName
    pilot: PilotName = "push"
    seed: int = 0
    duration: float = 8.0
    max_wind: float = 3.0
    with_bumper: bool = True
    bumper: BumperSettings = field(default_factory=BumperSettings)
    carrier: QuadrotorSettings = field(default_factory=QuadrotorSettings)


@dataclass(frozen=True, slots=True)
class Pushed:
    """What became of it.

    Attributes
    ----------
    least_gap : m, between hull and structure; a run ends with contact, below zero
    top_speed : m/s
    largest_push : m/s²
    path : (K, 2) m
    latencies : (K,) s, from the last points to the command, on a core of its own (time of the
        thread, so that what else runs does not count)
    """

    least_gap: float
    top_speed: float
    largest_push: float
    path: Array
    latencies: Array

    @property
    def touched(self) -> bool:
        """Whether there was contact."""
        return self.least_gap <= 0.0


def run_push(run: PushRun) -> Pushed:
    """Fly one run."""
    rng = np.random.default_rng([run.seed, *run.place.encode()])
    world = World(PLACES[run.place](rng))
    carrier = Quadrotor(
        run.carrier, free_start(world, rng, 1.0), np.zeros(3), rng.uniform(0, 2 * np.pi)
    )
    flight = _Flight(run, world, carrier, rng)
    for k in range(round((WARM_UP + run.duration) / PERIOD)):
        if flight.step(k * PERIOD):
            break
    return flight.result()


class _Flight:
    def __init__(
        self, run: PushRun, world: World, carrier: Quadrotor, rng: np.random.Generator
    ) -> None:
        self._run, self._world, self._carrier, self._rng = run, world, carrier, rng
        self._bumper = VirtualBumper(run.bumper)
        # Toward the door from its room; anywhere else.
        heading = rng.uniform(0.0, 2 * np.pi) * (run.place != "door")
        self._course = np.array([np.cos(heading), np.sin(heading)])
        self._speed = rng.uniform(0.5, MAX_SPEED)
        n = round((WARM_UP + run.duration) / PERIOD)
        gusts = [ornstein_uhlenbeck(rng, n, PERIOD, 2.0, 0.25) for _ in range(2)]
        blows = rng.uniform(0.0, 2 * np.pi)
        steady = rng.uniform(0.2, 0.6) * np.array([np.cos(blows), np.sin(blows)])
        wind = run.max_wind * (steady + np.column_stack(gusts))
        size = np.linalg.norm(wind, axis=1, keepdims=True)
        self._wind = wind * np.minimum(1.0, run.max_wind / np.maximum(size, 1e-9))
        self._spin_rate = np.radians(rng.uniform(250.0, 400.0))
        self._spin = rng.uniform(0.0, 2 * np.pi)
        self._gap, self._top, self._push = np.inf, 0.0, 0.0
        self._path: list[Array] = []
        self._latencies: list[float] = []

    def step(self, now: float) -> bool:
        """Fly one period; return whether something was touched."""
        carrier = self._carrier
        hovering = now < WARM_UP
        stick = np.zeros(2) if hovering else self._stick()
        if self._run.with_bumper:
            stick = self._bumped(now, stick, hovering=hovering)
        self._spin += self._spin_rate * PERIOD
        if hovering:
            return False
        wind = self._wind[round(now / PERIOD)]
        for _ in range(SUBSTEPS):
            carrier.step(stick[0], stick[1], wind, PERIOD / SUBSTEPS)
        gap = hull_clearance(self._world, self._run.carrier, carrier.position)
        self._gap = min(self._gap, gap)
        self._top = max(self._top, float(np.linalg.norm(carrier.velocity)))
        self._path.append(carrier.position[:2].copy())
        return gap <= 0.0

    def result(self) -> Pushed:
        return Pushed(
            self._gap, self._top, self._push, np.array(self._path), np.array(self._latencies)
        )

    def _stick(self) -> Array:
        """Roll and pitch of a pilot who wants his speed along his course and sees no structure."""
        if self._run.pilot == "drift":
            return np.zeros(2)
        carrier = self._carrier
        missing = self._speed * self._course - carrier.velocity[:2]
        cos, sin = np.cos(carrier.yaw), np.sin(carrier.yaw)
        forward = cos * missing[0] + sin * missing[1]
        left = cos * missing[1] - sin * missing[0]
        return np.clip(_PILOT_GAIN * np.array([-left, forward]), -MAX_STICK, MAX_STICK)

    def _bumped(self, now: float, stick: Array, *, hovering: bool) -> Array:
        sweeps = self._spin + self._spin_rate * PERIOD * np.array([-0.5, 0.0])
        points = scan(self._world, self._carrier, sweeps, self._rng)
        state = believed(now, self._carrier, self._rng)
        timed = not hovering and round(now / PERIOD) % TIMED_EVERY == 0
        begun = time.thread_time() if timed else 0.0
        self._bumper.add_points(now, self._carrier.position, points)
        command = self._bumper.command(now, state, pilot_roll=stick[0], pilot_pitch=stick[1])
        if timed:
            self._latencies.append(time.thread_time() - begun)
        self._push = max(self._push, float(np.linalg.norm(command.push)))
        return np.array([command.roll, command.pitch])
