# SPDX-License-Identifier: MIT OR Apache-2.0
"""A merged map against the truth of its simulated flights: the numbers that the bench and tests share."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scoring import best_points, in_flight, read_scene, sampled

from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.evaluate.alignment import align
from bentwing.evaluate.map import surface_error
from bentwing.evaluate.trajectory import absolute_error
from bentwing.map.read import read_points

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.evaluate.trajectory import AbsoluteError


@dataclass(frozen=True, slots=True)
class MergedScore:
    """Errors of a merged map.

    Attributes
    ----------
    before, after : m, root mean square, how far the runs are off where the first one is, when all are
        aligned as one; as their places put them, and in the end
    ates : m, in flight, each run aligned by itself
    joint : m, in flight, all runs aligned as one
    map_std, map_ratio : m, and over that of the map made with the truth
    """

    before: float
    after: float
    ates: list[float]
    joint: float
    map_std: float
    map_ratio: float


def merged_score(simulated: Sequence[Path], folder: Path) -> MergedScore:
    """Compare a merged map with its flights, given in the order of the runs."""
    runs = json.loads((folder / "run.json").read_text())["runs"]
    flights = [
        _flight(sim, folder / run["trajectory"]) for sim, run in zip(simulated, runs, strict=True)
    ]
    ates = [_error(estimate, truth) for estimate, truth, _ in flights]
    placed = []
    for sim, run in zip(simulated, runs, strict=True):
        own = _flight(sim, Path(run["folder"]) / "trajectory.txt")
        placed.append((_moved(own[0], np.array(run["T_map_run_by_places"])), own[1], own[2]))
    scene = read_scene(simulated[0] / "truth_scene.ply")
    points = sampled(read_points(next(folder.glob("map.*"))))
    best = np.concatenate(
        [
            best_points(sim, truth, origin, in_flight(truth))
            for sim, (_, truth, origin) in zip(simulated, flights, strict=True)
        ]
    )
    R, t, errors = _aligned_as_one([flight[:2] for flight in flights])
    error = surface_error(
        scene.distance(np.ascontiguousarray(points @ R.T + t))[0],
        best=scene.distance(np.ascontiguousarray(best))[0],
    )
    return MergedScore(
        before=_between(_aligned_as_one([p[:2] for p in placed])[2]),
        after=_between(errors),
        ates=[error.position.rmse for error in ates],
        joint=_rms(np.concatenate(errors)),
        map_std=error.std,
        map_ratio=error.best_ratio or np.nan,
    )


def _flight(simulated: Path, path: Path) -> tuple[Trajectory, Trajectory, int]:
    truth, origin_ns = read_tum(simulated / "truth_trajectory.txt")
    return read_tum(path, origin_ns)[0], truth, origin_ns


def _error(estimate: Trajectory, truth: Trajectory) -> AbsoluteError:
    return absolute_error(estimate, truth, during=in_flight(truth))


def _moved(trajectory: Trajectory, T: np.ndarray) -> Trajectory:
    positions = trajectory.positions @ T[:3, :3].T + T[:3, 3]
    return Trajectory(trajectory.times, positions, trajectory.quats_xyzw)


def _pairs(estimate: Trajectory, truth: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Positions of both in flight."""
    first, last = in_flight(truth)
    times = estimate.times[(estimate.times >= first) & (estimate.times <= last)]
    return estimate.interpolate(times)[0], truth.interpolate(times)[0]


def _aligned_as_one(
    flights: Sequence[tuple[Trajectory, Trajectory]],
) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Rotation and shift of all runs together to the truth, and the errors (N, 3) of each, m."""
    pairs = [_pairs(*flight) for flight in flights]
    aligned = align(np.concatenate([e for e, _ in pairs]), np.concatenate([p for _, p in pairs]))
    return aligned.R, aligned.t, [e @ aligned.R.T + aligned.t - p for e, p in pairs]


def _between(errors: Sequence[np.ndarray]) -> float:
    """Errors of the other runs beside the mean one of the first, m."""
    return _rms(np.concatenate(errors[1:]) - errors[0].mean(axis=0))


def _rms(errors: np.ndarray) -> float:
    return float(np.sqrt((errors**2).sum(axis=1).mean()))
