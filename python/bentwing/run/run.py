# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a run has found."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.trajectory import Trajectory
from bentwing.map.sample import MapSample
from bentwing.recording import ImuBatch

if TYPE_CHECKING:
    from pathlib import Path

    from bentwing.base.estimate import Estimate
    from bentwing.recording import Batch


@dataclass(slots=True)
class Run:
    """What a run has found so far; complete when `map_recording` returns.

    Attributes
    ----------
    out : the run folder
    estimate : trajectory, calibration and diagnostics; None before there are any
    sample : evenly chosen points of the map
    spin_times, spin_rates : s and rad/s, rate of turn of the IMU, about ten a second
    """

    out: Path
    estimate: Estimate | None = None
    sample: MapSample = field(default_factory=MapSample)
    spin_times: list[float] = field(default_factory=list)
    spin_rates: list[float] = field(default_factory=list)

    @property
    def trajectory(self) -> Trajectory:
        """Poses of the IMU in the map; empty before there are any."""
        return _NO_TRAJECTORY if self.estimate is None else self.estimate.trajectory

    def watch(self, batch: Batch) -> None:
        """Note the rate of turn of an IMU batch."""
        if isinstance(batch, ImuBatch) and len(batch.times):
            self.spin_times.append(float(batch.times.mean()))
            self.spin_rates.append(float(np.median(np.linalg.norm(batch.gyro, axis=1))))


_NO_TRAJECTORY = Trajectory(np.empty(0), np.empty((0, 3)), np.empty((0, 4)))
