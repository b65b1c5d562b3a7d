# SPDX-License-Identifier: MIT OR Apache-2.0
"""From returns in the moving lidar frame to points in the map, chunk by chunk."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import numpy as np

from bentwing import geometry
from bentwing.map.chunk import MapChunk
from bentwing.recording.batches import LidarBatch

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from bentwing.estimators.interface import Calibration
    from bentwing.recording.batches import Batch
    from bentwing.recording.payload import Encoder, Transform
    from bentwing.trajectory import Trajectory

_Scalar = TypeVar("_Scalar", bound=np.generic)

# Large enough that array calls cost nothing beside their work, small enough for the cache.
POINTS_PER_CHUNK = 100_000


def project(
    batches: Iterable[Batch],
    trajectory: Trajectory,
    calibration: Calibration,
    *,
    encoder: Encoder | None = None,
    counts: dict[str, int] | None = None,
) -> Iterator[MapChunk]:
    """Put every return where it was measured.

    Parameters
    ----------
    batches : stream of the recording; what is not lidar is passed over
    trajectory : poses of the IMU in the map
    calibration : latency, `T_imu_lidar` and encoder zero of the estimate
    encoder : of a motor-turned lidar; its mount then stands in for `T_imu_lidar`
    counts : receives `map.points`, `map.outside_trajectory` and `map.not_finite`

    Yields
    ------
    Chunks of about `POINTS_PER_CHUNK` points in the order of measurement.
    """
    counts = {} if counts is None else counts
    for name in ("map.points", "map.outside_trajectory", "map.not_finite"):
        counts.setdefault(name, 0)
    for batch in _gathered(batches):
        times = batch.times - calibration.latency
        covered = trajectory.covers(times)
        finite = np.isfinite(batch.points).all(axis=1)
        counts["map.outside_trajectory"] += int(np.count_nonzero(~covered))
        counts["map.not_finite"] += int(np.count_nonzero(covered & ~finite))
        keep = covered & finite
        if not keep.all():
            batch, times = batch.where(keep), times[keep]
        counts["map.points"] += len(times)
        if len(times):
            yield MapChunk(
                trajectory.transform_points(to_imu(batch, calibration, encoder), times),
                times,
                np.linalg.norm(batch.points, axis=1).astype(np.float32),
                batch.intensity,
                batch.ring,
            )


def to_imu(
    batch: LidarBatch, calibration: Calibration, encoder: Encoder | None
) -> NDArray[np.float64]:
    """Coordinates in the IMU frame, `(N, 3)` m, at the time of each return.

    With an encoder the lidar's pose is `T_imu_motor · Rot(axis, θ + zero) · T_motor_lidar`.
    """
    if encoder is None:
        return geometry.compose(
            calibration.T_imu_lidar_translation, calibration.T_imu_lidar_quat_xyzw, batch.points
        )
    if batch.angles is None:
        msg = "batch.angles: expected the motor's angle of every return, got None"
        raise ValueError(msg)
    points = geometry.compose(*_pose(encoder.T_motor_lidar), batch.points)
    angles = batch.angles + calibration.encoder_zero
    points = geometry.rotate(geometry.exp(angles[:, None] * np.array(encoder.axis)), points)
    return geometry.compose(*_pose(encoder.T_imu_motor), points)


def _pose(transform: Transform) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return np.array(transform.translation), np.array(transform.quaternion)


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
            yield _joined(waiting)
            waiting, n_waiting = [], 0
    if waiting:
        yield _joined(waiting)


def _joined(batches: list[LidarBatch]) -> LidarBatch:
    return LidarBatch(
        np.concatenate([batch.points for batch in batches]).astype(np.float64, copy=False),
        np.concatenate([batch.times for batch in batches]),
        _joined_field([batch.intensity for batch in batches]),
        _joined_field([batch.ring for batch in batches]),
        _joined_field([batch.angles for batch in batches]),
    )


def _joined_field(parts: list[NDArray[_Scalar] | None]) -> NDArray[_Scalar] | None:
    """Join a field that the sensor either gives with every batch or not at all."""
    present = [part for part in parts if part is not None]
    return np.concatenate(present) if len(present) == len(parts) else None
