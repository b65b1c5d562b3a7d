# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fly and estimate several flights, two at a time, each in a process of its own."""

from __future__ import annotations

import multiprocessing
import os
import tempfile
from concurrent.futures import ProcessPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.base.errors import InputError
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.alignment import align, associate
from bentwing.evaluate.simulated import true_calibration
from bentwing.evaluate.trajectory import absolute_error
from bentwing.map.project import placed_points
from bentwing.reproduce.trials import attempt, motor_stopped
from bentwing.simulate.scenario import Scenario
from bentwing.simulate.simulation import simulate

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from concurrent.futures import Future

    from numpy.typing import NDArray

    from bentwing.base.window_record import WindowRecord
    from bentwing.reproduce.figure import Assignment
    from bentwing.reproduce.trials import Attempt, Flight

    Array = NDArray[np.float64]

LOST = 2.0
"""m, of the ATE: the estimate has left the way."""
_STRAIGHT = 0.05  # least extent of a way to its side, as a share of that along it
_POLL = 0.3  # s, between two looks at how far the processes are
_WORKERS = 2
_NO_POINTS = np.zeros((0, 3), np.float32)


@dataclass(frozen=True, slots=True)
class Result:
    """What a trial has found on a flight, placed on the truth.

    Attributes
    ----------
    trajectory : as estimated; None if the estimator gave up
    aligned : moved onto the truth as a whole
    from_start : moved so that the first poses agree
    distances : (N,) m, from the truth at its stamps `distance_times`, when the positions are aligned
    points : (P, 3) float32, m, some of the returns in the map by `aligned`
    why : the estimator gave up
    windows : records of the estimator
    length, seconds, cpu : s, of the recording, and what the estimate took
    """

    trajectory: Trajectory | None
    aligned: Trajectory | None
    from_start: Trajectory | None
    distance_times: Array
    distances: Array
    points: NDArray[np.float32]
    why: str
    windows: list[WindowRecord]
    length: float
    seconds: float
    cpu: float

    @property
    def ate(self) -> float:
        """Mean distance from the truth after alignment, m; infinite without an estimate."""
        return float(self.distances.mean()) if len(self.distances) else float("inf")

    @property
    def rmse(self) -> float:
        """Root mean square of the same, m."""
        return float(np.sqrt(np.mean(self.distances**2))) if len(self.distances) else float("inf")

    @property
    def lost(self) -> bool:
        """Whether it gave up, or left the way."""
        return not self.rmse <= LOST


@dataclass(frozen=True, slots=True)
class Flown:
    """A flight with its truth and results.

    Attributes
    ----------
    truth : poses of the IMU
    true_points : (P, 3) float32, m, some of the returns in the map by true poses and mounts
    unturned_points : the same as if the motor stood still; empty without one
    results : by the names of the trials
    """

    flight: Flight
    truth: Trajectory
    true_points: NDArray[np.float32]
    unturned_points: NDArray[np.float32]
    results: dict[str, Result]

    @property
    def way(self) -> Array:
        """Length of the way flown (N,) m at the truth's stamps, over tenths of seconds."""
        times = np.append(np.arange(self.truth.times[0], self.truth.times[-1], 0.1), self.truth.times[-1])  # fmt: skip
        steps = np.linalg.norm(np.diff(self.truth.interpolate(times)[0], axis=0), axis=1)
        way: Array = np.interp(self.truth.times, times, np.concatenate([[0.0], np.cumsum(steps)]))
        return way


@dataclass(frozen=True, slots=True)
class Job:
    """Something to do in a process of its own.

    Attributes
    ----------
    name : by which its result is found
    work : s of recordings to go through, by which the progress is shown
    do : a function of a module, called with an empty folder, what to call with the seconds that are
        done, and `arguments`
    """

    name: str
    work: float
    do: Callable[..., Any]
    arguments: tuple[Any, ...] = ()


def gather(jobs: Sequence[Job], assignment: Assignment) -> dict[str, Any]:
    """Do the jobs, the longest first; the results do not depend on which ends first."""
    # A fork would copy the locks of the threads that run here.
    context = multiprocessing.get_context("spawn")
    done = context.Value("d", 0.0)
    ordered = sorted(jobs, key=lambda job: -job.work)
    stage = assignment.progress.stage("fly and map", sum(job.work for job in jobs))
    with tempfile.TemporaryDirectory(dir=assignment.out) as scratch, stage as shown:
        workers = min(_WORKERS, os.cpu_count() or 1)
        with ProcessPoolExecutor(workers, context, _share, (done,)) as pool:
            running = {
                job.name: pool.submit(_do, job, Path(scratch) / f"{number}")
                for number, job in enumerate(ordered)
            }
            _show(list(running.values()), lambda: done.value, shown.advance)
            return {job.name: running[job.name].result() for job in jobs}


def flight_job(flight: Flight, assignment: Assignment) -> Job:
    """Make the job of simulating a flight and running its trials; it results in a `Flown`."""
    seconds = flight.seconds(quick=assignment.quick)
    return Job(
        flight.name, seconds * (1 + len(flight.trials)), fly, (flight, seconds, assignment.seed)
    )


def _show(
    jobs: list[Future[Any]], done: Callable[[], float], advance: Callable[[float], None]
) -> None:
    """Show how far the jobs are until the last has ended, or the first has failed."""
    waiting, before = set(jobs), 0.0
    while waiting:
        ended, waiting = wait(waiting, timeout=_POLL)
        now = done()
        advance(now - before)
        before = now
        if any(job.exception() for job in ended):
            for job in waiting:
                job.cancel()
            return


_done: Any = None  # the counter that the processes share


def _share(counter: Any) -> None:  # noqa: ANN401 - a synchronized value has no public type
    global _done
    _done = counter


def _advance(seconds: float) -> None:
    if _done is not None:
        with _done.get_lock():
            _done.value += seconds


def steps(advance: Callable[[float], None]) -> Callable[[float], None]:
    """Make of a function that takes steps one that takes how far it is."""
    reached = 0.0

    def at(time: float) -> None:
        nonlocal reached
        advance(time - reached)
        reached = time

    return at


def _do(job: Job, folder: Path) -> Any:  # noqa: ANN401 - whatever the job results in
    return job.do(folder, _advance, *job.arguments)


def fly(
    folder: Path, advance: Callable[[float], None], flight: Flight, seconds: float, seed: int
) -> Flown:
    """Simulate one flight, run its trials, and remove the recording."""
    scenario = Scenario(duration=seconds, seed=seed, **flight.scenario)
    files = simulate(scenario, folder, steps(advance))
    results: dict[str, Result] = {}
    truth, true_points, unturned = None, _NO_POINTS, _NO_POINTS
    for trial in flight.trials:
        tried = attempt(folder, trial, 1, advance)
        if truth is None:
            truth, true = tried.truth, true_calibration(folder)
            true_points = placed_points(tried.lidar, truth, true).astype(np.float32)
            stopped = motor_stopped(tried.lidar)
            unturned = placed_points(stopped, truth, true).astype(np.float32)
        results[trial.name] = _result(tried)
    files.recording.unlink()
    if truth is None:
        msg = f"{flight.name}: expected at least one trial, got none"
        raise ValueError(msg)
    return Flown(flight, truth, true_points, unturned, results)


def as_a_whole(estimate: Trajectory, truth: Trajectory) -> Trajectory:
    """Move an estimate so that its positions agree best with the truth.

    About a straight way positions leave a turn open: there attitudes on average agree instead. They
    would be no good elsewhere, for an error of the mount turns them all.
    """
    found, true = associate(estimate, truth)
    along, beside, _ = np.linalg.svd(true.positions - true.positions.mean(axis=0), compute_uv=False)
    if beside > _STRAIGHT * along:
        return align(found.positions, true.positions).apply(estimate)
    offsets = geometry.multiply(true.quats_xyzw, geometry.inverse(found.quats_xyzw))
    turn = geometry.mean_rotation(offsets)
    middle, aim = found.positions.mean(axis=0), true.positions.mean(axis=0)
    placed = geometry.rotate(turn, estimate.positions - middle) + aim
    return Trajectory(estimate.times, placed, geometry.multiply(turn, estimate.quats_xyzw))


def with_first_pose(estimate: Trajectory, truth: Trajectory) -> Trajectory:
    """Move an estimate so that its first pose with a truth is the true one."""
    found, true = associate(estimate, truth)
    turn = geometry.multiply(true.quats_xyzw[0], geometry.inverse(found.quats_xyzw[0]))
    placed = geometry.rotate(turn, estimate.positions - found.positions[0]) + true.positions[0]
    return Trajectory(estimate.times, placed, geometry.multiply(turn, estimate.quats_xyzw))


def _result(tried: Attempt) -> Result:
    """Place what was found on the truth."""
    times, distances = np.zeros(0), np.zeros(0)
    points = _NO_POINTS
    trajectory = aligned = from_start = None
    windows: list[WindowRecord] = []
    why = tried.why
    if tried.estimate is not None:
        trajectory, windows = tried.estimate.trajectory, tried.estimate.windows
        try:
            error = absolute_error(trajectory, tried.truth)
        except InputError as problem:
            why = str(problem)
        else:
            aligned = as_a_whole(trajectory, tried.truth)
            from_start = with_first_pose(trajectory, tried.truth)
            times, distances = error.times, error.distances
            found = placed_points(tried.lidar, aligned, tried.estimate.calibration)
            points = found.astype(np.float32)
    return Result(
        trajectory, aligned,
        from_start, times, distances, points, why, windows,
        tried.length, tried.seconds, tried.cpu,
    )  # fmt: skip
