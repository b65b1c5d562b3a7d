# SPDX-License-Identifier: MIT OR Apache-2.0
"""What every estimator returns, so that nothing downstream knows which one ran."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bentwing.base.calibration import Calibration
    from bentwing.base.trajectory import Trajectory


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
