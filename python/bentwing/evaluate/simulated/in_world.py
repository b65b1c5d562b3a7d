# SPDX-License-Identifier: MIT OR Apache-2.0
"""How far path and map of a run are off in the world, whatever the run calls its IMU's axes and clock.

A run whose set-up was repaired may be right and yet have its IMU frame turned and its stamps on
another clock than the truth. So the path is that of the lidar, and neither axes nor stamps count.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.calibration import Calibration
from bentwing.base.run_record import read_record
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.evaluate.alignment import align, associate
from bentwing.evaluate.simulated.measured import measured_points, path_of_lidar
from bentwing.evaluate.simulated.truth import sampled

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.evaluate.alignment import Alignment
    from bentwing.evaluate.simulated.truth import Truth

    Array = NDArray[np.float64]

SEARCHED, STEP, FINEST = 4.0, 0.1, 1e-4  # s, of the offset between the clocks
OTHER_EPOCH = 10.0  # s; clocks that differ by more have another origin
SHARE = 90.0  # %, of the points whose distances are the map's error
ON_NO_SURFACE = 0.2  # m


@dataclass(frozen=True, slots=True)
class WorldError:
    """Errors of one run.

    Attributes
    ----------
    path : m, root mean square of the lidar's positions in flight, aligned rigidly
    map : m, nine tenths of the points measured in flight are nearer to the true surfaces
    astray : share of these points on no surface
    clock : s, added to the run's stamps to compare them
    covered : share of the flight for which there are poses
    """

    path: float
    map: float
    astray: float
    clock: float
    covered: float


def world_error(truth: Truth, run: Path, *, any_clock: bool = False) -> WorldError:
    """Compare what `bentwing map` left in `run` with the truth.

    Parameters
    ----------
    truth : of the recording, before a fault was put into it
    any_clock : whether the run's stamps may be on another clock; the offset that fits best is found

    Raises
    ------
    InputError
        If the run has no poses in flight.
    """
    calibration = Calibration.from_json(read_record(run)["calibration"])
    estimate, _ = read_tum(run / "trajectory.txt", truth.origin_ns)
    found = path_of_lidar(estimate, calibration)
    true = path_of_lidar(truth.trajectory, truth.calibration)
    clock = _offset(found, true, truth.flight) if any_clock else 0.0
    ours, theirs = associate(_shifted(found, clock), true, truth.flight)
    alignment = align(ours.positions, theirs.positions)
    errors = alignment.put(ours.positions) - theirs.positions
    distances = np.abs(truth.distances(_flown(run, truth, alignment)))
    n_flown = np.count_nonzero((true.times >= truth.flight[0]) & (true.times <= truth.flight[1]))
    return WorldError(
        path=float(np.sqrt((errors**2).sum(axis=1).mean())),
        map=float(np.percentile(distances, SHARE)),
        astray=float((distances > ON_NO_SURFACE).mean()),
        clock=clock,
        covered=len(ours) / n_flown,
    )


def _shifted(trajectory: Trajectory, seconds: float) -> Trajectory:
    return Trajectory(trajectory.times + seconds, trajectory.positions, trajectory.quats_xyzw)


def _offset(found: Trajectory, true: Trajectory, flight: tuple[float, float]) -> float:
    """Find what must be added to the run's stamps so that its path fits the true one best, s."""
    origin = float(true.times[0] - found.times[0])
    best = origin if abs(origin) > OTHER_EPOCH else 0.0
    times = np.arange(*flight, STEP)
    targets = true.interpolate(times)[0]

    def misfit(offset: float) -> float:
        seen = found.covers(times - offset)
        if np.count_nonzero(seen) < 0.5 * len(times):
            return float("inf")
        points = found.interpolate(times[seen] - offset)[0]
        alignment = align(points, targets[seen])
        return float(np.mean((alignment.put(points) - targets[seen]) ** 2))

    width, step = SEARCHED, STEP
    while step > FINEST:
        offsets = best + np.arange(-width, width + 0.5 * step, step)
        best = float(offsets[np.argmin([misfit(offset) for offset in offsets])])
        width, step = step, 0.1 * step
    return best


def _flown(run: Path, truth: Truth, alignment: Alignment) -> Array:
    """Return some points (N, 3) that were measured in flight, as measured, in the world.

    The flight is the same share of the map's time as of the truth's, on whatever clock.
    """
    points, times = measured_points(run / "map.laz", truth.origin_ns)
    first, last = times.min(), times.max()
    begin, end = np.array(truth.flight) / truth.trajectory.times[-1]
    at = (times - first) / max(last - first, 1e-9)
    return alignment.put(sampled(points[(at >= begin) & (at <= end)]))
