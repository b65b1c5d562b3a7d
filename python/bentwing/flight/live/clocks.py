# SPDX-License-Identifier: MIT OR Apache-2.0
"""The clocks of live sensors: batches with their stamps put where these belong."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.clocks.live import LiveClock

if TYPE_CHECKING:
    from bentwing.recording.batches import EncoderBatch, ImuBatch, LidarBatch


class LiveClocks:
    """One clock each for the IMU, the encoder and the lidar's scans."""

    def __init__(self) -> None:
        self._imu, self._encoder, self._lidar = LiveClock(), LiveClock(), LiveClock()
        self._newest_point = -np.inf

    def imu(self, batch: ImuBatch) -> ImuBatch:
        """Return the samples at the times of their clock."""
        return replace(batch, times=self._imu.steadied(batch.times))

    def encoder(self, batch: EncoderBatch) -> EncoderBatch:
        """Return the angles at the times of their clock."""
        return replace(batch, times=self._encoder.steadied(batch.times))

    def points(self, batch: LidarBatch, stamp: float) -> LidarBatch:
        """Return the points of a scan with this stamp, s, in the order of time with those before."""
        shift = float(self._lidar.steadied(np.array([stamp]))[0]) - stamp
        times = np.maximum(batch.times + shift, self._newest_point)
        self._newest_point = float(times[-1]) if len(times) else self._newest_point
        return replace(batch, times=times)
