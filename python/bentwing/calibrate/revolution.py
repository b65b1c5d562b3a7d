# SPDX-License-Identifier: MIT OR Apache-2.0
"""The parts of a recording to calibrate by: the carrier at rest while the motor turns evenly."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import savgol_filter

from bentwing.base.errors import NotEnoughDataError, PayloadError, RecordingError
from bentwing.recording import EncoderBatch, ImuBatch, LidarBatch
from bentwing.recording.preprocess import preprocess

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.progress import Stage
    from bentwing.recording.preprocess import RecordingPart

    Array = NDArray[np.float64]

TURN = 2 * np.pi
# Means over so long are judged, s.
BLOCK = 0.2
# A carrier at rest turns no faster, rad/s (a bias of the gyro included), nor by more beside its
# usual rate there; and its specific force does not change by more, m/s².
MAX_REST_RATE, MAX_RATE_CHANGE, MAX_FORCE_CHANGE = 0.05, 0.01, 0.1
# Within a stretch the motor's rate stays this near to its median, as a share of it.
MAX_UNEVENNESS = 0.1
# A motor that turns more slowly stands, rad/s.
LEAST_RATE = 0.02
# Over so long the angles are smoothed, s: about a sweep, whose errors in common are estimated. What is
# shorter in an encoder's angles is noise as long as the motor turns evenly.
SMOOTHING = 0.1
# More points are thinned out: they would say nothing new.
MAX_POINTS = 600_000
# Points whose stamps are wrong by the same, s, and at most so many such sweeps.
SWEEP, MAX_SWEEPS = 0.15, 160


@dataclass(frozen=True, slots=True)
class Stretch:
    """Whole revolutions at one rate with the carrier at rest.

    Attributes
    ----------
    start, stop : s, lidar clock
    n_turns : whole revolutions
    rate : rad/s, negative against the axis
    """

    start: float
    stop: float
    n_turns: int
    rate: float


@dataclass(frozen=True, slots=True)
class Revolutions:
    """What the lidar saw during one stretch or several.

    Attributes
    ----------
    points : (N, 3) m, lidar frame
    angles : (N,) rad, of the encoder
    rates : (N,) rad/s, of the motor
    halves : (N,) 0 or 1, the half-scan a point belongs to, by the angle
    sweeps : (N,) number of the sweep whose stamps share their errors
    stretches : where all this is from
    """

    points: Array
    angles: Array
    rates: Array
    halves: NDArray[np.int64]
    sweeps: NDArray[np.int64]
    stretches: tuple[Stretch, ...]

    def every(self, step: int) -> Revolutions:
        """Return every so many of the points."""
        one = slice(None, None, step)
        return Revolutions(
            self.points[one],
            self.angles[one],
            self.rates[one],
            self.halves[one],
            self.sweeps[one],
            self.stretches,
        )


@dataclass(frozen=True, slots=True)
class Course:
    """Encoder angles and inertial samples of a recording: times (K,), angles (K,), and the samples."""

    times: Array
    angles: Array
    imu: ImuBatch | None

    @property
    def moves(self) -> bool:
        """Whether the carrier leaves its place."""
        if self.imu is None:
            return False
        _, rate, _ = _blocks(self.imu)
        return bool((np.linalg.norm(rate, axis=1) > 5 * MAX_REST_RATE).sum() * BLOCK > 1.0)


def read_course(part: RecordingPart, shown: Stage) -> Course:
    """Read encoder and IMU of a recording."""
    encoder: list[EncoderBatch] = []
    imu: list[ImuBatch] = []
    for batch in part.batches(shown, Counter()):
        if isinstance(batch, EncoderBatch):
            encoder.append(batch)
        elif isinstance(batch, ImuBatch):
            imu.append(batch)
    samples = ImuBatch.joined(imu) if imu else None
    empty = [np.zeros(0)]
    return Course(
        np.concatenate([b.times for b in encoder] or empty),
        np.concatenate([b.angles for b in encoder] or empty),
        samples,
    )


def find_stretches(course: Course) -> tuple[Stretch, ...]:
    """Return the whole revolutions at a constant rate while the carrier is at rest.

    Raises
    ------
    RecordingError
        There is no encoder's angle, no rest, no constant rate.
    NotEnoughDataError
        There is less than one revolution.
    """
    times, angles = course.times, course.angles
    if len(times) < 2:
        msg = "the encoder sends no angles: the motor-lidar transform cannot be calibrated without"
        raise RecordingError(msg)
    turned = float(abs(angles - angles[0]).max())
    if turned < TURN:
        msg = (
            f"the motor turns by {np.degrees(turned):.0f}° in all, a whole revolution is needed: "
            "record for longer, or turn faster"
        )
        raise NotEnoughDataError(msg)
    grid = np.arange(times[0], times[-1], BLOCK)
    rates = np.diff(np.interp(grid, times, angles)) / BLOCK
    even = _runs(rates)
    if not any(_turns(course, *_span(grid, run)) >= 1 for run in even):
        msg = (
            "the motor does not turn at a constant rate for a whole revolution (its rate goes from "
            f"{rates.min():.2f} to {rates.max():.2f} rad/s): let it run at one rate, and record "
            "a revolution more"
        )
        raise RecordingError(msg)
    at_rest = _at_rest(course, grid)
    found = []
    for run in even:
        for still in _true_runs(at_rest, run):
            start, stop = _span(grid, still)
            if (n := _turns(course, start, stop)) >= 1:
                found.append(_whole(course, start, n, float(np.median(rates[still]))))
    if not found:
        msg = (
            "the carrier moves before the motor has turned once at a constant rate: put it down, let "
            "nobody touch it, and record one whole revolution"
        )
        raise RecordingError(msg)
    return tuple(found)


def read_revolutions(
    part: RecordingPart, course: Course, stretches: Sequence[Stretch]
) -> Revolutions:
    """Read the points of the stretches.

    Raises
    ------
    PayloadError
        All points are dropped by the payload's ranges and boxes.
    """
    kept: list[tuple[LidarBatch, int]] = []
    n_sweeps = 0
    for stretch in stretches:
        begin = max(0.0, stretch.start - 1.0)
        stream = part.recording.batches(begin, stretch.stop - begin + 1.0)
        for batch in preprocess(stream, part.payload, Counter()):
            if not isinstance(batch, LidarBatch) or batch.angles is None:
                continue
            first, last = np.searchsorted(batch.times, [stretch.start, stretch.stop])
            if last > first:
                kept.append((batch.where(slice(int(first), int(last))), n_sweeps))
                n_sweeps += 1
    n = sum(len(batch.times) for batch, _ in kept)
    if not n:
        msg = "no lidar point is left in the revolutions: check min_range, max_range and self_hits"
        raise PayloadError(msg)
    step, merged = -(-n // MAX_POINTS) | 1, -(-n_sweeps // MAX_SWEEPS)
    thin = [(batch.where(slice(None, None, step)), i // merged) for batch, i in kept]
    points = np.concatenate([b.points for b, _ in thin])
    times = np.concatenate([b.times for b, _ in thin])
    angles, rates = _smoothed(course, times)
    # By the angle itself, so that stretches in both directions have the same halves.
    halves = np.floor(angles / np.pi).astype(np.int64) % 2
    sweeps = np.repeat([i for _, i in thin], [len(b.times) for b, _ in thin])
    return Revolutions(points, angles, rates, halves, sweeps, tuple(stretches))


def _smoothed(course: Course, times: Array) -> tuple[Array, Array]:
    """Return angle and rate at `times` of a parabola through the encoder's angles around each."""
    step = float(np.median(np.diff(course.times)))
    half = max(1, int(SMOOTHING / step / 2))
    grid = np.arange(times.min() - SMOOTHING, times.max() + SMOOTHING + step, step)
    read = np.interp(grid, course.times, course.angles)
    width = 2 * half + 1
    smooth, slope = (
        savgol_filter(read, width, 2, deriv=order, delta=step, mode="nearest") for order in (0, 1)
    )
    return np.interp(times, grid, smooth), np.interp(times, grid, slope)


def _runs(rates: Array) -> list[slice]:
    """Return the runs of blocks in which the motor keeps its rate."""
    runs, first = [], 0
    for i in range(1, len(rates) + 1):
        middle = float(np.median(rates[first:i])) if i > first else 0.0
        limit = MAX_UNEVENNESS * abs(middle)
        if i < len(rates) and abs(rates[i] - middle) <= limit and abs(middle) > LEAST_RATE:
            continue
        if i - first > 1:
            runs.append(slice(first, i))
        first = i
    return runs


def _span(grid: Array, run: slice) -> tuple[float, float]:
    return float(grid[run.start]), float(grid[min(run.stop, len(grid) - 1)])


def _turns(course: Course, start: float, stop: float) -> int:
    begin, end = np.interp([start, stop], course.times, course.angles)
    return int(abs(end - begin) / TURN)


def _whole(course: Course, start: float, n_turns: int, rate: float) -> Stretch:
    """Return the stretch from `start` on that ends after whole revolutions."""
    begin = float(np.interp(start, course.times, course.angles))
    later = course.times >= start
    turned = abs(course.angles[later] - begin)
    stop = float(course.times[later][int(np.argmax(turned >= n_turns * TURN))])
    return Stretch(start, stop, n_turns, rate)


def _at_rest(course: Course, grid: Array) -> NDArray[np.bool_]:
    """Tell of each block whether the carrier is at rest; without an IMU it is believed to be."""
    if course.imu is None or len(course.imu.times) < 2:
        return np.ones(len(grid) - 1, dtype=np.bool_)
    times, rate, force = _blocks(course.imu)
    slow = np.linalg.norm(rate, axis=1) < MAX_REST_RATE
    if slow.any():
        usual, pull = np.median(rate[slow], axis=0), np.median(force[slow], axis=0)
        slow &= np.linalg.norm(rate - usual, axis=1) < MAX_RATE_CHANGE
        slow &= np.linalg.norm(force - pull, axis=1) < MAX_FORCE_CHANGE
    # A block of the motor is at rest if the inertial blocks around its ends are.
    nearest = np.clip(np.searchsorted(times, grid), 0, len(times) - 1)
    before = np.maximum(nearest - 1, 0)
    fine = slow[nearest] & slow[before]
    return np.asarray(fine[1:] & fine[:-1])


def _blocks(imu: ImuBatch) -> tuple[Array, Array, Array]:
    """Return the middles (B,) of blocks, and the mean rates and forces (B, 3) in them."""
    index = ((imu.times - imu.times[0]) / BLOCK).astype(np.int64)
    _, index = np.unique(index, return_inverse=True)
    n = np.bincount(index)

    def mean(values: Array) -> Array:
        return np.stack([np.bincount(index, v) / n for v in values.T], axis=1)

    return np.bincount(index, imu.times) / n, mean(imu.gyro), mean(imu.accel)


def _true_runs(flags: NDArray[np.bool_], within: slice) -> list[slice]:
    """Return the runs of true flags in a slice."""
    padded = np.concatenate([[False], flags[within], [False]]).astype(np.int8)
    steps = np.diff(padded)
    firsts, stops = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)
    at = within.start
    return [slice(at + int(a), at + int(b)) for a, b in zip(firsts, stops, strict=True)]
