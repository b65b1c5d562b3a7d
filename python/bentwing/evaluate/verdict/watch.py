# SPDX-License-Identifier: MIT OR Apache-2.0
"""What samples say of themselves, summed up while they are read."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.evaluate.verdict.imu_samples import ImuSamples
from bentwing.evaluate.verdict.inertial_track import InertialTrack
from bentwing.evaluate.verdict.returns import Returns
from bentwing.recording.batches import ImuBatch, LidarBatch

if TYPE_CHECKING:
    from bentwing.recording.batches import Batch


class Watch:
    """Sums up batches as an estimator gets them; holds 6 kB a second, less than the trajectory.

    Attributes
    ----------
    imu : what the inertial samples look like
    track : how the IMU has turned and accelerated
    returns : what the lidar's returns look like
    """

    def __init__(self) -> None:
        self.imu = ImuSamples()
        self.track = InertialTrack()
        self.returns = Returns()

    def add(self, batch: Batch) -> None:
        """Take the next batch."""
        if not len(batch.times):
            return
        if isinstance(batch, ImuBatch):
            self.imu.add(batch)
            self.track.add(batch)
        elif isinstance(batch, LidarBatch):
            self.returns.add(batch)
