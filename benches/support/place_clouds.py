# SPDX-License-Identifier: MIT OR Apache-2.0
"""Points of simulated flights, placed by their true poses: what the benches of places compare.

A run's map frame is turned and shifted at random against the world, and its points drift by a few
millimetres, as an estimator's do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.trajectory import Trajectory
from bentwing.base.transform import upright
from bentwing.simulate.ranging import Airframe, nodes_around
from bentwing.simulate.scenario import Scenario
from bentwing.simulate.simulation import prepare

if TYPE_CHECKING:
    from pathlib import Path

DRIFT = 0.002
"""m per square root of a second, each axis: a random walk."""
THINNING = {"hokuyo-spin": 1, "vlp16-motor": 12, "vlp16-fixed": 12}
"""Of so many beams, one is cast: what is left is still as much as a place holds of it."""
THINNING_FAR = 4
"""The same where few beams return: over towns and before dams."""
POSE_STEP = 0.1


@dataclass(frozen=True, slots=True)
class SimulatedRun:
    """A run as it leaves an estimator, with the truth about its frame.

    Attributes
    ----------
    points, times : (N, 3) m, map frame; (N,) s
    trajectory : of the lidar in the map
    T_world_map : (4, 4)
    """

    points: np.ndarray
    times: np.ndarray
    trajectory: Trajectory
    T_world_map: np.ndarray


def simulated_run(scenario: Scenario) -> SimulatedRun:
    """Fly the scenario, and place its returns by the true poses."""
    setup = prepare(scenario)
    ranger, rig = setup.sensors.ranger, setup.rig
    ranger = replace(ranger, bodies=[b for b in ranger.bodies if not isinstance(b, Airframe)])
    points, times = [], []
    far = scenario.scene in {"town", "dam"}
    thinning = THINNING_FAR if far else THINNING[scenario.head]
    for start in np.arange(setup.first, setup.last, 1.0):
        beams = rig.head.lidar.beams(start, min(start + 1.0, setup.last))
        if beams is None:
            continue
        keep = np.s_[::thinning] if beams.sweep_axis == 0 else np.s_[:, ::thinning]
        beams = replace(beams, times=beams.times[keep], directions=beams.directions[keep])
        ranges, _ = ranger.measure(beams)
        ok = np.isfinite(ranges) & (ranges > 0.4)
        nodes = nodes_around(beams, rig.lidar)
        origins, directions = nodes.place(beams.times[ok], beams.directions[ok])
        points.append(origins + directions * ranges[ok][:, None])
        times.append(beams.times[ok])
    poses = np.arange(setup.first, setup.last + POSE_STEP, POSE_STEP)
    lidar = rig.lidar(poses)
    rng = np.random.default_rng([scenario.seed, scenario.flight_seed or 0, 17])
    yaw = rng.uniform(-np.pi, np.pi)
    T_world_map = upright(yaw, lidar.p[0] + rng.uniform(-20.0, 20.0, 3))
    walk = np.cumsum(rng.normal(0.0, DRIFT * np.sqrt(POSE_STEP), lidar.p.shape), axis=0)
    all_times = np.concatenate(times)
    drift = np.column_stack([np.interp(all_times, poses, walk[:, i]) for i in range(3)])
    R, t = T_world_map[:3, :3], T_world_map[:3, 3]
    placed = (np.concatenate(points) + drift - t) @ R
    identity = np.tile([0.0, 0.0, 0.0, 1.0], (len(poses), 1))
    track = Trajectory(poses, (lidar.p + walk - t) @ R, identity)
    return SimulatedRun(placed, all_times, track, T_world_map)


@dataclass(frozen=True, slots=True)
class FlightKind:
    """Flights of one scene: enough time to see some of it, and heads that see it."""

    scene: str
    heads: tuple[str, ...]
    duration: float
    flight: str = "tour"

    def scenario(self, seed: int, number: int) -> Scenario:
        """Flight `number` in the world of `seed`; heads alternate where there are several."""
        head = self.heads[number % len(self.heads)] if seed % 2 else self.heads[0]
        return Scenario(
            scene=self.scene,
            seed=seed,
            flight_seed=100 * seed + number,
            head=head,
            duration=self.duration,
            flight=self.flight,
        )


FLIGHTS = (
    FlightKind("office", ("hokuyo-spin", "vlp16-motor"), 30.0),
    FlightKind("courtyard", ("hokuyo-spin", "vlp16-fixed"), 30.0),
    FlightKind("forest", ("hokuyo-spin",), 30.0),
    FlightKind("cave", ("hokuyo-spin",), 40.0),
    FlightKind("mine", ("hokuyo-spin",), 50.0),
    FlightKind("town", ("vlp16-motor",), 58.0),
    FlightKind("dam", ("vlp16-motor",), 30.0, "survey"),
    FlightKind("compound", ("hokuyo-spin", "vlp16-fixed"), 40.0),
    FlightKind("mocap", ("vlp16-motor", "hokuyo-spin"), 30.0),
    FlightKind("carpark", ("vlp16-motor",), 40.0),
    FlightKind("campus", ("vlp16-motor",), 40.0),
)


def kept_run(scenario: Scenario, folder: Path | None) -> SimulatedRun:
    """Return the run as kept in `folder`, or fly it, and keep it there."""
    if folder is None:
        return simulated_run(scenario)
    path = folder / f"{_name(scenario)}.npz"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        run = simulated_run(scenario)
        track = run.trajectory
        np.savez(
            path,
            points=run.points.astype(np.float32),
            times=run.times,
            tt=track.times,
            tp=track.positions,
            T=run.T_world_map,
        )
    kept = np.load(path)
    upright = np.tile([0.0, 0.0, 0.0, 1.0], (len(kept["tt"]), 1))
    track = Trajectory(kept["tt"], kept["tp"], upright)
    return SimulatedRun(kept["points"].astype(np.float64), kept["times"], track, kept["T"])


def _name(scenario: Scenario) -> str:
    number = (scenario.flight_seed or 0) % 100
    name = f"{scenario.scene}_{scenario.seed}_{number}_{scenario.head}"
    things = "" if scenario.things_seed is None else f"_things{scenario.things_seed}"
    return name + things + (f"_boxes{scenario.boxes}" if scenario.boxes else "")
