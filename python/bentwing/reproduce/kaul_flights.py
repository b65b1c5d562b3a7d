# SPDX-License-Identifier: MIT OR Apache-2.0
"""The flights of Kaul 2015, section 4.2, simulated and mapped, and what they are compared with."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from bentwing.base.clock import NS_PER_S, format_ns
from bentwing.base.mount import mount_from_json
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.map.chunk import MapChunk
from bentwing.map.project import project
from bentwing.map.writer import open_map
from bentwing.recording import Payload, Recording
from bentwing.recording.preprocess import RecordingPart
from bentwing.run.choose import as_run_settings
from bentwing.run.pipeline import run_recording
from bentwing.run.run import Run
from bentwing.simulate.instruments import TerrestrialErrors, choose_stations, scan, track
from bentwing.simulate.ros import EPOCH_NS
from bentwing.simulate.scenario import Scenario
from bentwing.simulate.simulation import prepare
from bentwing.simulate.write import write_recording

if TYPE_CHECKING:
    from pathlib import Path

    from bentwing.reproduce.figure import Assignment
    from bentwing.run.found import Found
    from bentwing.simulate.names import SceneName
    from bentwing.simulate.setup import Setup
    from bentwing.simulate.write import SimulatedRecording

N_STATIONS = 6
_STEP, _QUICK_STEP = np.radians([0.15, 0.3])  # between the beams of the terrestrial scanner

_BEST_STEP = 7  # every seventh point is enough for a distribution


@dataclass(frozen=True, slots=True)
class FlightPlan:
    """A flight of the paper.

    Attributes
    ----------
    name, scene : of the folder, and of the world
    duration, quick_duration : s
    speed : m/s, at which the length of the way becomes the paper's
    max_range : m; in daylight the scanner sees hardly farther than 15 m (section 5.1)
    """

    name: str
    scene: SceneName
    duration: float
    quick_duration: float
    speed: float
    max_range: float


COMPOUND = FlightPlan("compound", "compound", 408.0, 45.0, 0.795, 15.0)
FOREST = FlightPlan("forest", "forest", 312.0, 40.0, 0.625, 15.0)
MINE = FlightPlan("mine", "mine", 120.0, 30.0, 1.0, 30.0)


@dataclass(frozen=True, slots=True)
class Flown:
    """A flight that was simulated and mapped.

    Attributes
    ----------
    plan : it was flown after
    setup : world, rig and sensors of the simulation
    files : recording and truth
    folder : of the run
    run, record : the run, and its run.json
    found : what its stages have found
    """

    plan: FlightPlan
    setup: Setup
    files: SimulatedRecording
    folder: Path
    run: Run
    found: Found
    record: dict[str, Any]

    @property
    def duration(self) -> float:
        """Length of the recording, s."""
        return self.setup.last - self.setup.first


def fly_and_map(plan: FlightPlan, assignment: Assignment) -> Flown:
    """Simulate a flight on the passively spun head, and map its recording with the defaults."""
    scenario = Scenario(
        scene=plan.scene,
        duration=plan.quick_duration if assignment.quick else plan.duration,
        seed=assignment.seed,
        spin="plant",
        speed=plan.speed,
        max_range=plan.max_range,
    )
    folder = assignment.out / plan.name
    # an earlier reproduction is made anew, in case the simulation has changed
    (folder / "recording.bag").unlink(missing_ok=True)
    with assignment.progress.stage(f"fly {plan.name}", scenario.duration) as shown:
        setup, reached = prepare(scenario), 0.0

        def advance(time: float) -> None:
            nonlocal reached
            shown.advance(time - reached)
            reached = time

        files = write_recording(setup, scenario, folder, advance)
    out = folder / "run"
    settings = as_run_settings(payload=files.payload)
    found = run_recording(
        files.recording, out, settings, files.payload, progress=assignment.progress
    )
    record = json.loads((out / "run.json").read_text(encoding="utf-8"))
    return Flown(plan, setup, files, out, Run.of(out, found), found, record)


def truth_of(flown: Flown) -> tuple[Trajectory, int]:
    """Return the true poses of the IMU on the clock of the run, and when that begins."""
    with Recording(flown.files.recording, Payload.load(flown.files.payload)) as recording:
        return read_tum(flown.files.trajectory, recording.clock.start_ns)


def write_track(flown: Flown, assignment: Assignment) -> tuple[Path, float]:
    """Track the flight by a total station; return its file and the share that was in view."""
    rng = np.random.default_rng([assignment.seed, 19])
    setup = flown.setup
    sighting = track(setup.world, setup.rig, (setup.first, setup.last), rng)
    path = flown.files.recording.parent / "total_station.txt"
    with path.open("w", encoding="utf-8") as file:
        file.write("# t x y z\n")
        for time, place in zip(sighting.times.tolist(), sighting.positions, strict=True):
            stamp = format_ns(EPOCH_NS + round(time * NS_PER_S))
            file.write(f"{stamp} {' '.join(f'{value:.4f}' for value in place)}\n")
    return path, sighting.share_seen


def write_terrestrial(flown: Flown, assignment: Assignment) -> tuple[Path, int]:
    """Scan the world from six stations; return the cloud, with the station as time, and its size."""
    rng = np.random.default_rng([assignment.seed, 21])
    errors = TerrestrialErrors()
    stations = choose_stations(flown.setup.world, rng, N_STATIONS, errors)
    path = flown.files.recording.parent / "terrestrial.las"
    yaw, shift = rng.uniform(-np.pi, np.pi), np.array([120.0, -45.0, 7.0])
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    step = float(_QUICK_STEP if assignment.quick else _STEP)
    stage = assignment.progress.stage("scan by tripod", float(N_STATIONS), "stations")
    with open_map(path, "las", EPOCH_NS) as writer, stage as shown:
        for number, station in enumerate(stations):
            for points in scan(flown.setup.world, station, step, rng, errors):
                ranges = np.linalg.norm(points - station.place, axis=1).astype(np.float32)
                times = np.full(len(points), float(number))
                writer.write(MapChunk(points @ turn.T + shift, times, ranges))
            shown.advance(1.0)
    return path, writer.n_points


def write_best_map(flown: Flown, assignment: Assignment, truth: Trajectory) -> Path:
    """Write the map that true poses and calibration make: nothing but the lidar's noise is in it."""
    true = yaml.safe_load(flown.files.calibration.read_text(encoding="utf-8"))
    estimate = flown.run.estimate
    calibration = replace(
        estimate.calibration, latency=true["latency"], mount=mount_from_json(true)
    )
    path = flown.files.recording.parent / "best_map.las"
    payload = Payload.load(flown.files.payload)
    with Recording(flown.files.recording, payload) as recording:
        part = RecordingPart(recording, payload)
        stage = assignment.progress.stage("best map", part.length)
        with open_map(path, "las", EPOCH_NS) as writer, stage as shown:
            batches = part.batches(shown, Counter())
            for chunk in project(batches, truth, calibration):
                writer.write(chunk.where(slice(None, None, _BEST_STEP)))
    return path
