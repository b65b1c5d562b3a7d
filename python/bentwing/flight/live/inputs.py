# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a live user hands over, checked before anything is changed by it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.clock import NS_PER_S
from bentwing.recording.batches import EncoderBatch, ImuBatch, LidarBatch
from bentwing.recording.readings import EncoderReading, ImuReading, LidarReading

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from bentwing.recording.batches import Batch

# Float64 cannot hold the seconds of an epoch to better than 0.24 µs; nobody maps for three years.
_LONGEST = 1e8


class InputOrder:
    """Makes batches of arrays, refusing what goes back in time within one sensor.

    The readings are those of the payload; without one the samples are batches' already.
    """

    def __init__(self) -> None:
        self._newest: dict[type[Batch], float] = {}

    def imu(
        self,
        times: ArrayLike,
        gyro: ArrayLike,
        accel: ArrayLike,
        reading: ImuReading = ImuReading(),  # noqa: B008 - frozen
    ) -> ImuBatch:
        """Return inertial samples, one or many."""
        stamps = self._times("IMU", ImuBatch, times, reading.offset_ns)
        return ImuBatch(
            stamps,
            reading.gyro.vectors(_table("IMU", "gyro", gyro, stamps)),
            reading.accel.vectors(_table("IMU", "accel", accel, stamps)),
        )

    def points(
        self,
        points: ArrayLike,
        times: ArrayLike,
        rings: ArrayLike | None = None,
        reading: LidarReading = LidarReading(),  # noqa: B008 - frozen
        *,
        overlaps: bool = False,
    ) -> LidarBatch:
        """Return returns of the lidar; with `overlaps` they may begin before the batch before ends."""
        stamps = self._times("point", LidarBatch, times, reading.offset_ns, overlaps=overlaps)
        table = _table("point", "points", points, stamps)
        if rings is None:
            return reading.batch(LidarBatch(table, stamps))
        numbers = np.array(rings, dtype=np.float64, ndmin=1)
        if numbers.shape != stamps.shape:
            msg = f"{_named('point', stamps)}: rings: expected shape {stamps.shape}, got {numbers.shape}"
            raise ValueError(msg)
        _require_finite("point", "rings", numbers, stamps)
        if len(numbers) and not (numbers.min() >= 0 and numbers.max() < 2**16):
            msg = f"{_named('point', stamps)}: rings: expected 0 to 65535"
            raise ValueError(msg)
        return reading.batch(LidarBatch(table, stamps, ring=numbers.astype(np.uint16)))

    def encoder(
        self,
        times: ArrayLike,
        angles: ArrayLike,
        reading: EncoderReading = EncoderReading(),  # noqa: B008 - frozen
    ) -> EncoderBatch:
        """Return angles of the motor, one or many."""
        stamps = self._times("encoder", EncoderBatch, times, reading.offset_ns)
        values = np.array(angles, dtype=np.float64, ndmin=1)
        if values.shape != stamps.shape:
            msg = f"{_named('encoder', stamps)}: angles: expected shape {stamps.shape}, got {values.shape}"
            raise ValueError(msg)
        _require_finite("encoder", "angles", values, stamps)
        return EncoderBatch(stamps, reading.angles(values))

    def accept(self, batch: Batch) -> None:
        """Remember a batch that was taken."""
        if len(batch.times):
            self._newest[type(batch)] = float(batch.times[-1])

    def _times(
        self,
        sensor: str,
        kind: type[Batch],
        times: ArrayLike,
        offset_ns: int,
        *,
        overlaps: bool = False,
    ) -> NDArray[np.float64]:
        # A copy: drivers fill the same buffer again.
        stamps = np.array(times, dtype=np.float64, ndmin=1)
        if offset_ns:
            stamps += offset_ns / NS_PER_S
        if stamps.ndim != 1:
            msg = f"{sensor} batch: times: expected shape (N,), got {stamps.shape}"
            raise ValueError(msg)
        if not len(stamps):
            return stamps
        _require_finite(sensor, "times", stamps, stamps)
        if abs(stamps).max() > _LONGEST:
            msg = (
                f"{_named(sensor, stamps)}: times: expected seconds since a start of your choice; "
                "subtract it from the stamps while they are integer nanoseconds"
            )
            raise ValueError(msg)
        steps = np.diff(stamps)
        if np.any(steps < 0):
            row = int(np.argmax(steps < 0)) + 1
            msg = f"{_named(sensor, stamps)}: times: row {row} goes back by {-steps[row - 1]:.6f} s; sort by time"
            raise ValueError(msg)
        newest = self._newest.get(kind, -np.inf)
        if stamps[0] < newest and not overlaps:
            msg = (
                f"{_named(sensor, stamps)}: times: begins before {newest:.6f} s, the end of the "
                "batch before; feed each sensor in the order of its time"
            )
            raise ValueError(msg)
        return stamps


def _table(
    sensor: str, name: str, values: ArrayLike, stamps: NDArray[np.float64]
) -> NDArray[np.float64]:
    table = np.array(values, dtype=np.float64, order="C", ndmin=2)
    expected = (len(stamps), 3)
    if table.shape != expected and not (table.size == 0 and not len(stamps)):
        msg = f"{_named(sensor, stamps)}: {name}: expected shape {expected}, got {np.shape(values)}"
        raise ValueError(msg)
    _require_finite(sensor, name, table, stamps)
    return table.reshape(expected)


def _require_finite(
    sensor: str, name: str, values: NDArray[np.float64], stamps: NDArray[np.float64]
) -> None:
    finite = np.isfinite(values)
    if finite.all():
        return
    rows = finite if finite.ndim == 1 else finite.all(axis=1)
    row = int(np.argmin(rows))
    hint = "; leave out the directions without a return" if name == "points" else ""
    msg = f"{_named(sensor, stamps)}: {name}: row {row} is not finite: {values[row]}{hint}"
    raise ValueError(msg)


def _named(sensor: str, stamps: NDArray[np.float64]) -> str:
    return f"{sensor} batch at {stamps[0]:.6f} s" if len(stamps) else f"{sensor} batch"
