# SPDX-License-Identifier: MIT OR Apache-2.0
"""A flight of Kaul 2015 against its total station, its terrestrial scan, and itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.trajectory import read_tum
from bentwing.evaluate.against_surface import compare_with_map, read_reference
from bentwing.evaluate.against_track import compare_with_track
from bentwing.evaluate.clouds import Cloud
from bentwing.evaluate.drift_boxes import DriftBoxes, drift_boxes
from bentwing.evaluate.evaluation import DriftOver, Evaluation
from bentwing.evaluate.simulated import in_flight
from bentwing.evaluate.spacing import point_spacing
from bentwing.evaluate.track import read_track
from bentwing.evaluate.trajectory import absolute_error
from bentwing.reproduce.kaul_flights import (
    truth_of,
    write_best_map,
    write_terrestrial,
    write_track,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.evaluate.trajectory import AbsoluteError
    from bentwing.reproduce.figure import Assignment
    from bentwing.reproduce.kaul_flights import Flown


@dataclass(frozen=True, slots=True)
class Measured:
    """What was measured of a flight.

    Attributes
    ----------
    evaluation : as `bentwing evaluate` has it; the drift is of the open loop against the closed
    against_truth : drift of the open loop against the truth
    absolute : error of the trajectory in flight, against the truth
    share_tracked : of the measurements the total station tried
    true_std : m, of the map against the true surfaces, which have no shadows
    best_std : m, of the map made with true poses and calibration, against the same reference
    terrestrial : an even sample of the terrestrial cloud, points (K, 3) m and stations (K,)
    n_terrestrial : points of it
    truth, flight : true poses on the run's clock, and first and last time in the air, s
    way, speeds, heights : m flown, m/s and m over the start, (N,) ten times a second
    """

    evaluation: Evaluation
    against_truth: list[DriftBoxes]
    absolute: AbsoluteError
    share_tracked: float
    true_std: float | None
    best_std: float | None
    terrestrial: tuple[NDArray[np.float64], NDArray[np.float64]] | None
    n_terrestrial: int
    truth: Trajectory
    flight: tuple[float, float]
    way: float
    speeds: NDArray[np.float64]
    heights: NDArray[np.float64]


def measure(flown: Flown, assignment: Assignment, *, scanned: bool) -> Measured:
    """Track the flight, scan its world if asked to, and compare."""
    progress = assignment.progress
    truth, origin_ns = truth_of(flown)
    track, share = write_track(flown, assignment)
    estimate = read_tum(flown.folder / "trajectory.txt", origin_ns)[0]
    odometry = read_tum(flown.folder / "odometry.txt", origin_ns)[0]
    flight = in_flight(truth)
    result = Evaluation()
    with progress.stage(f"compare {flown.plan.name}"):
        result.trajectory = compare_with_track(estimate, origin_ns, read_track(track))
        result.drift = DriftOver("odometry", "trajectory", drift_boxes(odometry, estimate))
        cloud = Cloud(flown.folder / "map.laz")
        result.spacing = point_spacing(cloud)
    true = best = terrestrial = None
    n_terrestrial = 0
    if scanned:
        path, n_terrestrial = write_terrestrial(flown, assignment)
        best_path = write_best_map(flown, assignment, truth)
        with progress.stage("compare the map"):
            reference = read_reference(path)
            result.reference_spacing = reference.spacing
            result.map = compare_with_map(cloud, reference, path=estimate)
            best = compare_with_map(Cloud(best_path), reference, path=truth).std
            surfaces = read_reference(flown.files.scene)
            true = compare_with_map(cloud, surfaces, path=estimate).std
        best_path.unlink()
        sample = Cloud(path, 400_000).sample
        terrestrial = (sample.points, sample.times - sample.times.min())
    way, speeds, heights = _motion(flown, flight)
    return Measured(
        result,
        drift_boxes(odometry, truth),
        absolute_error(estimate, truth, during=flight),
        share,
        true,
        best,
        terrestrial,
        n_terrestrial,
        truth,
        flight,
        way,
        speeds,
        heights,
    )


def _motion(
    flown: Flown, flight: tuple[float, float]
) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """Length of the way, and speeds and heights of the carrier in flight."""
    times = np.arange(flown.setup.first, flown.setup.last, 0.1)
    places = flown.setup.rig.carrier.motion(times).p
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    flying = (times[1:] > flight[0] + flown.setup.first) & (times[1:] < flight[1])
    heights = places[1:, 2] - places[0, 2]
    return float(steps.sum()), steps[flying] / 0.1, heights[flying]
