# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a recording is read into: batches of samples in time order."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from bentwing.base.value import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

_Scalar = TypeVar("_Scalar", bound=np.generic)


@dataclass(frozen=True, slots=True, eq=False)
class LidarBatch(Value):
    """Consecutive returns of the lidar.

    Attributes
    ----------
    points : (N, 3) float64, m, lidar frame
    times : (N,) float64, s since the recording's start, non-decreasing, lidar clock
    intensity : (N,) float32 or None, as the sensor reports it
    ring : (N,) uint16 or None, beam number of a multi-beam lidar
    angles : (N,) float64 or None, rad, angle of the motor that turns the lidar at each point's
        time, unwrapped; set by preprocess
    attributes : (N,) structured or None, further fields that the payload asks for
    """

    points: NDArray[np.float64]
    times: NDArray[np.float64]
    intensity: NDArray[np.float32] | None = None
    ring: NDArray[np.uint16] | None = None
    angles: NDArray[np.float64] | None = None
    attributes: NDArray[np.void] | None = None

    def where(self, keep: NDArray[np.bool_] | NDArray[np.intp] | slice) -> LidarBatch:
        """Return the returns selected by a mask, by indices or by a slice."""
        chosen, intensity, ring, angles = numbered(keep), self.intensity, self.ring, self.angles
        attributes = self.attributes
        return LidarBatch(
            rows(self.points, chosen),
            rows(self.times, chosen),
            None if intensity is None else rows(intensity, chosen),
            None if ring is None else rows(ring, chosen),
            None if angles is None else rows(angles, chosen),
            None if attributes is None else rows(attributes, chosen),
        )

    @classmethod
    def joined(cls, batches: Sequence[LidarBatch]) -> LidarBatch:
        """Join batches that follow each other, at least one."""
        return cls(
            np.concatenate([batch.points for batch in batches]).astype(np.float64, copy=False),
            np.concatenate([batch.times for batch in batches]),
            _joined_field([batch.intensity for batch in batches]),
            _joined_field([batch.ring for batch in batches]),
            _joined_field([batch.angles for batch in batches]),
            _joined_field([batch.attributes for batch in batches]),
        )


@dataclass(frozen=True, slots=True, eq=False)
class ImuBatch(Value):
    """Consecutive inertial samples.

    Attributes
    ----------
    times : (M,) float64, s since the recording's start, increasing, IMU clock
    gyro : (M, 3) float64, rad/s, imu frame
    accel : (M, 3) float64, m/s², imu frame (specific force: +g upwards at rest)
    at_limit : (M, 6) bool or None, axes of gyro and accelerometer that are at the end of their range, so
        that the truth lies beyond; set by preprocess where any is
    """

    times: NDArray[np.float64]
    gyro: NDArray[np.float64]
    accel: NDArray[np.float64]
    at_limit: NDArray[np.bool_] | None = None

    def where(self, keep: NDArray[np.bool_] | NDArray[np.intp] | slice) -> ImuBatch:
        """Return the samples selected by a mask, by indices or by a slice."""
        at_limit = None if self.at_limit is None else self.at_limit[keep]
        return ImuBatch(self.times[keep], self.gyro[keep], self.accel[keep], at_limit)

    @classmethod
    def joined(cls, batches: Sequence[ImuBatch]) -> ImuBatch:
        """Join batches that follow each other; an empty one without any."""
        if not batches:
            return cls(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))
        at_limit = None
        if any(batch.at_limit is not None for batch in batches):
            none_of = [np.zeros((len(batch.times), 6), np.bool_) for batch in batches]
            parts = zip(batches, none_of, strict=True)
            at_limit = np.concatenate(
                [none if b.at_limit is None else b.at_limit for b, none in parts]
            )
        return cls(
            np.concatenate([batch.times for batch in batches]),
            np.concatenate([batch.gyro for batch in batches]),
            np.concatenate([batch.accel for batch in batches]),
            at_limit,
        )


@dataclass(frozen=True, slots=True, eq=False)
class EncoderBatch(Value):
    """Consecutive angles of the motor that turns the lidar.

    Attributes
    ----------
    times : (K,) float64, s since the recording's start, increasing
    angles : (K,) float64, rad, unwrapped (continuous over full turns, also between batches)
    """

    times: NDArray[np.float64]
    angles: NDArray[np.float64]


Batch = LidarBatch | ImuBatch | EncoderBatch


def numbered(keep: NDArray[np.bool_] | NDArray[np.intp] | slice) -> NDArray[np.intp] | slice:
    """Turn a mask into indices, once for all the fields it selects from."""
    if isinstance(keep, slice):
        return keep
    return np.flatnonzero(keep) if keep.dtype == np.bool_ else keep.astype(np.intp, copy=False)


def rows(values: NDArray[_Scalar], chosen: NDArray[np.intp] | slice) -> NDArray[_Scalar]:
    """Rows of values `(N, ...)`; `take` is several times faster than an index or a mask."""
    return values[chosen] if isinstance(chosen, slice) else values.take(chosen, axis=0)


def _joined_field(parts: list[NDArray[_Scalar] | None]) -> NDArray[_Scalar] | None:
    """Join a field that the sensor either gives with every batch or not at all."""
    present = [part for part in parts if part is not None]
    return np.concatenate(present) if len(present) == len(parts) else None
