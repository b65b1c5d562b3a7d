# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fig. 3 of Kaul 2015: a map with drift, after place recognition, and after global registration.

Our open loop drifts by millimetres, which no picture shows. So drift is put in on purpose, as much
in every flight, and what follows has to take it out.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory
from bentwing.base.transform import from_poses
from bentwing.closing.global_registration import close_loops
from bentwing.closing.places import MatchSettings, describe_run, link_between, match_places
from bentwing.closing.pose_graph import Links, PoseGraph, deform_trajectory, solve_pose_graph
from bentwing.evaluate.trajectory import absolute_error
from bentwing.recording import Payload, Recording
from bentwing.recording.preprocess import RecordingPart
from bentwing.report.colours import TIME
from bentwing.report.picture import paint, project
from bentwing.report.svg import map_view
from bentwing.reproduce.figure import Compared, Figure

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.closing.places import Place
    from bentwing.reproduce.figure import Assignment
    from bentwing.reproduce.kaul_flights import Flown

    Array = NDArray[np.float64]

_TURN, _SHIFT = np.radians(12.0), np.array([1.2, -0.8, 0.0])  # of the drift at the flight's end
_DRIFT_SIGMA = np.array([0.005, 0.005, 0.03, 0.15, 0.15, 0.05])  # of a link in time, rad and m
_FEW = MatchSettings(max_candidates=3)  # enough to tie a flight together
_APART = 2  # places; nearer ones in time are linked by the odometry
_CROP = 8.0  # m around the middle of the flight


@dataclass(frozen=True, slots=True)
class LoopStages:
    """The trajectory at the three stages, on the clock of the run.

    Attributes
    ----------
    drifted, linked, closed : trajectories
    n_links, n_false : matches of places, and how many of them the pose graph did not believe
    """

    drifted: Trajectory
    linked: Trajectory
    closed: Trajectory
    n_links: int
    n_false: int


def loop_figures(
    flown: Flown, truth: Trajectory, flight: tuple[float, float], assignment: Assignment
) -> tuple[list[Figure], list[Compared]]:
    """Make the three panels, and the errors of the trajectory in them."""
    with assignment.progress.stage("places"):
        stages = loop_stages(flown)
    names = (
        ("a", stages.drifted, "Open loop, with drift put in: 12° and 1.4 m by the end."),
        ("b", stages.linked, f"After place recognition: {stages.n_links} pairs of places; "
         f"{stages.n_false} of them were rejected."),
        ("c", stages.closed, "After global registration."),
    )  # fmt: skip
    figures, errors = [], []
    middle = np.median(stages.closed.positions, axis=0)
    for letter, trajectory, note in names:
        drawing = _by_time(flown, trajectory, middle)
        figures.append(Figure(f"fig03{letter}", drawing, f"Fig. 3{letter}", note))
        errors.append(100 * absolute_error(trajectory, truth, during=flight).position.rmse)
    row = Compared(
        "error of the trajectory with drift put in, rms: open loop, places, global registration",
        "shown as pictures",
        ", ".join(f"{error:.2g} cm" for error in errors),
    )
    return figures, [row]


def loop_stages(flown: Flown) -> LoopStages:
    """Put drift into the run's odometry and take it out again."""
    estimate = flown.run.estimate
    drifted = with_drift(estimate.trajectory)
    times = flown.found.sample.times
    points = moved(flown.found.sample.points, times, estimate.trajectory, drifted)
    places = describe_run(points, times, drifted)
    linked, n_links, n_false = _linked(drifted, places)
    payload = Payload.load(flown.files.payload)
    with Recording(flown.files.recording, payload) as recording:
        batches = RecordingPart(recording, payload).batches(_Silent(), Counter())
        closed = close_loops(replace(estimate, trajectory=linked), batches, payload)
    return LoopStages(drifted, linked, closed.estimate.trajectory, n_links, n_false)


class _Silent:
    def advance(self, amount: float) -> None:
        del amount


def with_drift(trajectory: Trajectory) -> Trajectory:
    """Turn and shift a trajectory more and more along its way, about its beginning."""
    steps = np.diff(trajectory.positions, axis=0)
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(steps, axis=1))])
    share = way / max(way[-1], 1e-9)
    turns = geometry.exp(share[:, None] * np.array([0.0, 0.0, _TURN]))
    positions = trajectory.positions[0] + np.vstack(
        [np.zeros(3), np.cumsum(geometry.rotate(turns[1:], steps), axis=0)]
    )
    return Trajectory(
        trajectory.times,
        positions + share[:, None] * _SHIFT,
        geometry.multiply(turns, trajectory.quats_xyzw),
    )


def moved(points: Array, times: Array, before: Trajectory, after: Trajectory) -> Array:
    """Carry map points (N, 3), measured at times (N,), from one trajectory to another."""
    times = np.clip(times, before.times[0], before.times[-1])
    p0, q0 = before.interpolate(times)
    p1, q1 = after.interpolate(times)
    turn = geometry.multiply(q1, geometry.inverse(q0))
    carried: Array = p1 + geometry.rotate(turn, points - p0)
    return carried


def _linked(drifted: Trajectory, places: list[Place]) -> tuple[Trajectory, int, int]:
    """Recognize places, solve their pose graph, and bend the trajectory to it."""
    spans = np.array([place.span for place in places])
    at = spans.mean(axis=1)
    positions, quats = drifted.interpolate(at)
    nodes = from_poses(positions, quats)
    half = len(places) // 2  # the flight out against the flight back
    found = [
        replace(c, j=c.j + half)
        for c in match_places(places[:half], places[half:], settings=_FEW)
        if c.accepted and c.alignment is not None and c.j + half - c.i >= _APART
    ]
    pairs = [(k, k + 1) for k in range(len(at) - 1)] + [(c.i, c.j) for c in found]
    n_time = len(at) - 1
    inward = geometry.inverse(quats[:-1])
    in_time = (
        geometry.rotate(inward, np.diff(positions, axis=0)),
        geometry.multiply(inward, quats[1:]),
    )
    links = [link_between(nodes[c.i], nodes[c.j], c.alignment) for c in found if c.alignment]
    graph = PoseGraph(
        positions,
        quats,
        Links(
            np.array(pairs, np.int64).reshape(-1, 2),
            np.vstack([in_time[0], *(link.position for link in links)]),
            np.vstack([in_time[1], *(link.quat_xyzw for link in links)]),
            np.concatenate(
                [
                    np.tile(np.diag(_DRIFT_SIGMA**-2.0), (n_time, 1, 1)),
                    *(link.information[None] for link in links),
                ]
            ),
            np.arange(len(pairs)) < n_time,
        ),
        np.arange(len(at)) == 0,
    )
    solution = solve_pose_graph(graph)
    bent = deform_trajectory(drifted, at, solution.positions, solution.quats_xyzw)
    return bent, len(found), len(solution.rejected)


def _by_time(flown: Flown, trajectory: Trajectory, middle: Array) -> str:
    """Plan of a crop of the map by time."""
    sample = flown.found.sample
    points = moved(sample.points, sample.times, flown.run.trajectory, trajectory)
    near = np.all(np.abs(points[:, :2] - middle[:2]) < _CROP, axis=1)
    near &= (
        points[:, 2] > trajectory.positions[0, 2] + 0.15
    )  # the ground would hide nothing but paper
    x, y, z = points[near].T
    view = paint(
        project(x, y, z, width=700, max_height=700, close_gaps=0),
        sample.times[near],
        table=TIME,
        shading=0.3,
    )
    return map_view(view, "time, s", TIME, name="Part of the map by time")
