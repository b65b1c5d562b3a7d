# SPDX-License-Identifier: MIT OR Apache-2.0
"""Everything that can be said about a run, with whatever references there are."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.base.progress import Progress, as_progress
from bentwing.base.regular_file import require_there
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.closing.localize.coordinates import coordinates_of_run
from bentwing.evaluate.against_surface import (
    THRESHOLD,
    MapError,
    Reference,
    compare_with_map,
    read_reference,
)
from bentwing.evaluate.against_track import TrackError, compare_with_track
from bentwing.evaluate.clouds import Cloud
from bentwing.evaluate.drift_boxes import DriftBoxes, drift_boxes
from bentwing.evaluate.entropy import MapEntropy, map_entropy
from bentwing.evaluate.revisits import Revisits, revisit_consistency
from bentwing.evaluate.spacing import PointSpacing, point_spacing
from bentwing.evaluate.thickness import Thickness, wall_thickness
from bentwing.evaluate.track import read_track
from bentwing.evaluate.tracked_point import moved_to_point

if TYPE_CHECKING:
    from pathlib import Path

    from bentwing.evaluate.subject import Subject


@dataclass(frozen=True, slots=True)
class Question:
    """What to compare a run with, and what is known about the references.

    Attributes
    ----------
    reference_trajectory, reference_map : files
    clock_offset : s, how far the clock of the reference trajectory is ahead; None: estimated
    lever_arm : m, point tracked by the reference trajectory in the IMU frame; None: estimated for
        positions, zero for poses
    threshold : m; points of the map that are farther from the reference have changed
    """

    reference_trajectory: Path | None = None
    reference_map: Path | None = None
    clock_offset: float | None = None
    lever_arm: tuple[float, float, float] | None = None
    threshold: float = THRESHOLD

    def files(self) -> list[Path]:
        """Return the references that are given."""
        listed = (self.reference_trajectory, self.reference_map)
        return [path for path in listed if path is not None]


@dataclass(frozen=True, slots=True)
class DriftOver:
    """Drift of one trajectory against another, by length of the way.

    Attributes
    ----------
    trajectory, against : their names
    lengths : one entry per length that fits
    """

    trajectory: str
    against: str
    lengths: list[DriftBoxes]


@dataclass(slots=True)
class Evaluation:
    """The answers; None where something was not asked or is not there, with a note why."""

    trajectory: TrackError | None = None
    drift: DriftOver | None = None
    map: MapError | None = None
    spacing: PointSpacing | None = None
    reference_spacing: PointSpacing | None = None
    thickness: Thickness | None = None
    entropy: MapEntropy | None = None
    revisits: Revisits | None = None
    notes: list[str] = field(default_factory=list)


def evaluate(
    subject: Subject, question: Question | None = None, progress: Progress | None = None
) -> Evaluation:
    """Measure all there is to measure.

    Raises
    ------
    UsageError
        If a reference is given for what the subject does not have.
    InputError
        If a file cannot be used, or a reference does not fit.
    """
    question, progress = question or Question(), as_progress(progress)
    for file in question.files():
        require_there(file)  # which nobody wants to know only once the map is measured
    if question.reference_trajectory is not None:
        subject = subject.flown_with(question.reference_trajectory)
    if question.reference_map is not None and subject.map_path is None:
        msg = "there is no map to compare with --reference-map"
        raise UsageError(msg)
    result = Evaluation()
    path = _trajectory(subject, question, progress, result)
    if subject.map_path is None:
        return result
    with progress.stage("reading the map"):
        cloud = Cloud(subject.map_path, georeference=subject.georeference)
    if cloud.n_not_finite:
        result.notes.append(
            f"{cloud.n_not_finite} of {cloud.n_points} points of the map are not finite and left out"
        )
    with progress.stage("measuring the map alone"):
        _map_alone(cloud, result)
    if question.reference_map is not None:
        with progress.stage("reading the reference map"):
            reference = read_reference(question.reference_map)
        with progress.stage("comparing the map with the reference"):
            _map(cloud, reference, path, question, result)
    return result


def _trajectory(
    subject: Subject, question: Question, progress: Progress, result: Evaluation
) -> Trajectory | None:
    """Answer what concerns the trajectory, and return it."""
    if subject.trajectory is None:
        return None
    estimate, origin_ns = read_tum(subject.trajectory)
    odometry = None if subject.odometry is None else read_tum(subject.odometry, origin_ns)[0]
    if question.reference_trajectory is not None:
        with progress.stage("comparing the trajectory with the reference"):
            placed = coordinates_of_run(subject.georeference)
            reference = read_track(question.reference_trajectory)
            if reference.n_repeats:
                result.notes.append(
                    f"{reference.n_repeats} of the reference's measurements repeat a stamp and are left out"
                )
            result.trajectory = compare_with_track(
                estimate,
                origin_ns,
                reference,
                clock_offset=question.clock_offset,
                lever_arm=question.lever_arm,
                written=None if placed is None else placed.to_projected,
            )
            if result.trajectory.is_straight:
                result.notes.append(
                    "the path is nearly straight: positions do not tell the turn about it, "
                    + (
                        "and without orientations nothing does"
                        if reference.quats_xyzw is None
                        else "so it is taken from the orientations"
                    )
                )
    with progress.stage("measuring drift"):
        _drift(estimate, odometry, result)
    return estimate


def _drift(estimate: Trajectory, odometry: Trajectory | None, result: Evaluation) -> None:
    """Drift of the open loop, against the reference if it has poses, else the closed loop."""
    name = "trajectory" if odometry is None else "odometry"
    against, reference = "trajectory", estimate
    drifting = estimate if odometry is None else odometry
    if result.trajectory is not None and result.trajectory.reference is not None:
        against, reference = "reference", result.trajectory.reference
        drifting = moved_to_point(drifting, result.trajectory.tracked_point.lever_arm)
    elif odometry is None:
        return
    elif _is_same(odometry, estimate):
        result.notes.append(
            "odometry.txt equals trajectory.txt, as no loop was closed; drift needs a reference "
            "trajectory with orientations"
        )
        return
    lengths = drift_boxes(drifting, reference)
    if not lengths:
        result.notes.append("the path is too short for a distribution of drift")
    result.drift = DriftOver(name, against, lengths)


def _is_same(a: Trajectory, b: Trajectory) -> bool:
    return np.array_equal(a.positions, b.positions) and np.array_equal(a.quats_xyzw, b.quats_xyzw)


def _map_alone(cloud: Cloud, result: Evaluation) -> None:
    points, times = cloud.sample.points, cloud.sample.times
    result.spacing = point_spacing(cloud)
    try:
        result.thickness = wall_thickness(points, times if cloud.has_times else None)
    except ValueError as error:
        result.notes.append(f"no wall thickness: {error}")
    result.entropy = map_entropy(points)
    result.revisits = revisit_consistency(points, times) if cloud.has_times else None
    if result.revisits is None:
        why = "no flat patch was seen twice" if cloud.has_times else "its points have no times"
        result.notes.append(f"no consistency of revisits in the map: {why}")


def _map(
    cloud: Cloud,
    reference: Reference,
    path: Trajectory | None,
    question: Question,
    result: Evaluation,
) -> None:
    result.reference_spacing = reference.spacing
    # where both references are in one frame, the trajectory has already found the way there
    starts = [] if result.trajectory is None else [result.trajectory.alignment]
    result.map = compare_with_map(
        cloud, reference, path=path, threshold=question.threshold, starts=starts
    )
