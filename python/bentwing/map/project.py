# SPDX-License-Identifier: MIT OR Apache-2.0
"""From returns in the moving lidar frame to points in the map, chunk by chunk."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.mount import MotorMount
from bentwing.map.chunk import MapChunk
from bentwing.map.mixed_pixels import mixed_pixels
from bentwing.odometry.core_states import core_globals, core_samples
from bentwing.recording.batches import LidarBatch

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from bentwing.base.calibration import Calibration
    from bentwing.base.trajectory import Trajectory
    from bentwing.recording.batches import Batch

# Large enough that array calls cost nothing beside their work, small enough for the cache.
POINTS_PER_CHUNK = 100_000


def project(
    batches: Iterable[Batch],
    trajectory: Trajectory,
    calibration: Calibration,
    *,
    segments: Sequence[tuple[float, float]] = (),
    threads: int | None = None,
    counts: dict[str, int] | None = None,
) -> Iterator[MapChunk]:
    """Put every return where it was measured (Kaul 2015, eq. 1 and 2).

    Parameters
    ----------
    batches : stream of the recording; what is not lidar is passed over
    trajectory : poses of the IMU in the map, at a uniform rate
    calibration : latency and mount of the lidar
    segments : first and last time of each stretch of the trajectory without a break, s; default:
        all of it is one
    threads : default: all cores
    counts : receives `map.points`, `map.outside_trajectory` and `map.not_finite`

    Yields
    ------
    Chunks of about `POINTS_PER_CHUNK` points in the order of measurement.
    """
    counts = {} if counts is None else counts
    for name in ("map.points", "map.outside_trajectory", "map.not_finite"):
        counts.setdefault(name, 0)
    samples, slow = core_samples(trajectory), core_globals(calibration)
    turned = isinstance(calibration.mount, MotorMount)
    for batch in _gathered(batches):
        if turned and batch.angles is None:
            msg = "batch.angles: expected the motor's angle of every return, got None"
            raise ValueError(msg)
        batch = _placeable(batch, trajectory, segments, calibration, counts)
        if len(batch.times):
            angles = batch.angles if turned else None
            points, beams, lengths = samples.place_shots(
                batch.points, batch.times, angles, slow, threads=threads or 0
            )
            ranges = lengths.astype(np.float32)
            yield MapChunk(
                points,
                calibration.measured(batch.times),
                ranges,
                batch.intensity,
                batch.ring,
                beams,
                mixed_pixels(batch.points, lengths, batch.times, batch.ring),
                run_id=np.zeros(len(ranges), np.uint16),
                attributes=batch.attributes,
            )


def placed_points(
    batches: Iterable[Batch], trajectory: Trajectory, calibration: Calibration
) -> NDArray[np.float64]:
    """Put returns where they were measured, on one thread: all points (N, 3), m, at once."""
    chunks = [chunk.points for chunk in project(batches, trajectory, calibration, threads=1)]
    return np.concatenate(chunks) if chunks else np.zeros((0, 3))


def _placeable(
    batch: LidarBatch,
    trajectory: Trajectory,
    segments: Sequence[tuple[float, float]],
    calibration: Calibration,
    counts: dict[str, int],
) -> LidarBatch:
    """Leave out, and count, what the trajectory does not cover or is not finite."""
    times = calibration.measured(batch.times)
    covered = trajectory.covers(times)
    if segments:
        inside = [(times >= first) & (times <= last) for first, last in segments]
        covered &= np.any(inside, axis=0)
    x, y, z = np.isfinite(batch.points).T
    finite = x & y & z
    counts["map.outside_trajectory"] += int(np.count_nonzero(~covered))
    counts["map.not_finite"] += int(np.count_nonzero(covered & ~finite))
    keep = covered & finite
    counts["map.points"] += int(np.count_nonzero(keep))
    return batch if keep.all() else batch.where(keep)


def _gathered(batches: Iterable[Batch]) -> Iterator[LidarBatch]:
    """Join small batches (a scan of a 2D lidar has 1,081 returns) into large ones."""
    waiting: list[LidarBatch] = []
    n_waiting = 0
    for batch in batches:
        if not isinstance(batch, LidarBatch):
            continue
        waiting.append(batch)
        n_waiting += len(batch.times)
        if n_waiting >= POINTS_PER_CHUNK:
            yield LidarBatch.joined(waiting)
            waiting, n_waiting = [], 0
    if waiting:
        yield LidarBatch.joined(waiting)
