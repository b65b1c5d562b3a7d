# SPDX-License-Identifier: MIT OR Apache-2.0
"""What every estimator takes and returns, so that nothing downstream knows which one ran."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bentwing.estimators.mount import Mount
    from bentwing.recording.batches import Batch
    from bentwing.trajectory import Trajectory


@dataclass(frozen=True, slots=True)
class Calibration:
    """The slow states at the end of the estimate, with their standard deviations.

    Attributes
    ----------
    latency : s, lidar stamps minus IMU clock: a lidar stamp t was measured at t - latency
    mount : where the lidar is, seen from the IMU
    gyro_bias, accel_bias : (3,) rad/s, m/s²
    gravity : (3,) m/s², map frame, pointing up
    std : standard deviation of what was estimated, by the names `latency` (1,),
        `extrinsic_rotation` (3,) rad and `extrinsic_translation` (3,) m of the lidar, or of the
        motor, in the IMU frame, `gyro_bias` (3,), `accel_bias` (3,), `gravity` (2,) rad, and for
        a motor `encoder_zero` (1,) rad, and of the lidar across the axis `motor_tilt` (2,) rad and
        `motor_offset` (2,) m
    """

    latency: float
    mount: Mount
    gyro_bias: NDArray[np.float64]
    accel_bias: NDArray[np.float64]
    gravity: NDArray[np.float64]
    std: dict[str, list[float]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Estimate:
    """Result of an estimator.

    Attributes
    ----------
    trajectory : 100 Hz poses of the IMU in the map
    calibration : the slow states at the end
    windows : one record per window (`time`, `n_surfels`, `n_matches`, `n_fixed_matches`,
        `inlier_share`, `residual_rms` in units of the noise, `iterations`, `degenerate`,
        eigenvalues of the geometric information, …), for run.json and the report
    counts : what was used and what was dropped
    timings : seconds of wall time by stage
    warnings : sentences about the health of the estimate
    segments : first and last time of each stretch without a break, s; between them the trajectory
        is a guess
    """

    trajectory: Trajectory
    calibration: Calibration
    windows: list[dict[str, Any]] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    timings: dict[str, float] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    segments: list[tuple[float, float]] = field(default_factory=list)


class Estimator(Protocol):
    """Feed batches in time order, then ask for the result."""

    def feed(self, batch: Batch) -> None:
        """Take the next batch; work that has become possible is done before it returns."""

    def result(self) -> Estimate:
        """Finish with what was fed so far."""

    def so_far(self) -> Estimate:
        """Return what is estimated already, without any further work."""
