# SPDX-License-Identifier: MIT OR Apache-2.0
"""Holds what was fed until a step of the estimator can use it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from bentwing.base.breaks import Break
from bentwing.odometry.segments import MAX_IMU_GAP, MAX_LIDAR_GAP, MAX_LIDAR_GAP_WITHOUT_IMU
from bentwing.recording.batches import EncoderBatch, ImuBatch, LidarBatch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.recording.batches import Batch


HELD = 1.0
"""Batches that end within this time before the last sweep or scan are not forgotten, s."""


@dataclass(frozen=True, slots=True)
class LidarStretch:
    """Lidar points of a stretch of time; fields as in `LidarBatch`."""

    points: NDArray[np.float64]
    times: NDArray[np.float64]
    angles: NDArray[np.float64] | None
    rings: NDArray[np.uint16] | None = None


class BatchBuffer:
    """Lidar and IMU batches in time order, cut by time."""

    def __init__(self) -> None:
        self._lidar: list[LidarBatch] = []
        self._imu: list[ImuBatch] = []
        self._breaks: list[Break] = []

    def add(self, batch: Batch) -> None:
        """Take the next batch; encoder batches have done their work in preprocess."""
        if isinstance(batch, EncoderBatch) or len(batch.times) == 0:
            return
        if isinstance(batch, LidarBatch):
            _require_usable(batch.times, points=batch.points)
            _require_order(self._lidar, batch)
            longest = MAX_LIDAR_GAP if self._imu else MAX_LIDAR_GAP_WITHOUT_IMU
            self._breaks += _breaks("lidar", self._lidar, batch, longest)
            self._lidar.append(batch)
        else:
            _require_usable(batch.times, gyro=batch.gyro, accel=batch.accel)
            _require_order(self._imu, batch)
            self._breaks += _breaks("inertial", self._imu, batch, MAX_IMU_GAP)
            self._imu.append(batch)

    @property
    def has_imu(self) -> bool:
        """Whether any inertial sample is held."""
        return bool(self._imu)

    @property
    def lidar_span(self) -> tuple[float, float] | None:
        """First and last lidar stamp, s."""
        if not self._lidar:
            return None
        return float(self._lidar[0].times[0]), float(self._lidar[-1].times[-1])

    @property
    def imu_span(self) -> tuple[float, float] | None:
        """First and last inertial stamp, s."""
        if not self._imu:
            return None
        return float(self._imu[0].times[0]), float(self._imu[-1].times[-1])

    def lidar(self, start: float, stop: float) -> LidarStretch:
        """Return the points with stamps in `[start, stop)`."""
        parts = [b for b in self._lidar if b.times[0] < stop and b.times[-1] >= start]
        if not parts:
            return LidarStretch(np.empty((0, 3)), np.empty(0), None)
        times = np.concatenate([b.times for b in parts])
        keep = slice(*np.searchsorted(times, [start, stop]))
        points = np.concatenate([b.points for b in parts])[keep]
        angles = [b.angles for b in parts if b.angles is not None]
        joined = np.concatenate(angles)[keep] if len(angles) == len(parts) else None
        rings = [b.ring for b in parts if b.ring is not None]
        numbers = np.concatenate(rings)[keep] if len(rings) == len(parts) else None
        return LidarStretch(np.ascontiguousarray(points), times[keep], joined, numbers)

    def imu(self, start: float, stop: float) -> ImuBatch:
        """Return the inertial samples with stamps in `[start, stop)`."""
        parts = [b for b in self._imu if b.times[0] < stop and b.times[-1] >= start]
        whole = ImuBatch.joined(parts)
        return whole.where(slice(*np.searchsorted(whole.times, [start, stop])))

    def first_break(self) -> Break | None:
        """Return the earliest silence that is too long."""
        return min(self._breaks, key=lambda b: b.start, default=None)

    def pass_over(self, silence: Break) -> None:
        """Forget a silence, but not the samples around it."""
        self._breaks.remove(silence)

    def cut(self, before: float) -> None:
        """Drop all samples before a time, s, and the breaks that end by then."""
        self._breaks = [b for b in self._breaks if b.stop > before]
        self._lidar = [b.where(b.times >= before) for b in self._lidar if b.times[-1] >= before]
        self._imu = [b.where(b.times >= before) for b in self._imu if b.times[-1] >= before]

    def forget(self, before: float) -> None:
        """Drop batches that end before a time, s."""
        self._lidar = [b for b in self._lidar if b.times[-1] >= before]
        self._imu = [b for b in self._imu if b.times[-1] >= before]


def _breaks(
    sensor: Literal["lidar", "inertial"],
    held: Sequence[LidarBatch | ImuBatch],
    batch: LidarBatch | ImuBatch,
    longest: float,
) -> list[Break]:
    before = held[-1].times[-1:] if held else batch.times[:1]
    times = np.concatenate([before, batch.times])
    return [
        Break(sensor, float(times[i]), float(times[i + 1]))
        for i in np.flatnonzero(np.diff(times) > longest)
    ]


def _require_usable(times: NDArray[np.float64], **fields: NDArray[np.float64]) -> None:
    """Refuse what is not finite here, where the batch is known; at rest nothing later would."""
    for name, values in {"times": times, **fields}.items():
        finite = np.isfinite(values)
        if not finite.all():
            row = int(np.argmin(finite if finite.ndim == 1 else finite.all(axis=1)))
            msg = f"{name}: row {row} of a batch at {times[0]:.3f} s is not finite: {values[row]}"
            raise ValueError(msg)


def _require_order(held: Sequence[LidarBatch | ImuBatch], batch: LidarBatch | ImuBatch) -> None:
    before = held[-1].times[-1] if held else -np.inf
    if batch.times[0] < before or np.any(np.diff(batch.times) < 0):
        msg = f"times: must not decrease, but a batch at {batch.times[0]:.3f} s does, after {before:.3f} s"
        raise ValueError(msg)
