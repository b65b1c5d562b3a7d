# SPDX-License-Identifier: MIT OR Apache-2.0
"""What every estimator returns, so that nothing downstream knows which one ran."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from bentwing.base.value import Value

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bentwing.base.breaks import Break
    from bentwing.base.calibration import Calibration
    from bentwing.base.covariances import PoseCovariances
    from bentwing.base.trajectory import Trajectory
    from bentwing.base.window_record import WindowRecord


@dataclass(frozen=True, slots=True, eq=False)
class Estimate(Value):
    """Result of an estimator.

    Attributes
    ----------
    trajectory : 100 Hz poses of the IMU in the map
    calibration : the slow states at the end
    windows : one record per window, sweep or scan
    counts : what was used and what was dropped
    timings : seconds of wall time by stage
    health : sentences about what makes the estimate worse than usual, breaks apart
    notes : sentences about what is usual and worth knowing
    breaks : where the recording breaks
    segments : first and last time of each stretch without a break, s; between them the trajectory
        is a guess
    covariances : of the poses; None where the estimator has none
    short_variances : (6,) of `[δr, δt]`, rad² and m², of a pose as seen from the one ten metres of path
        before it, in the mean; None where the estimator does not say, or the path is shorter
    """

    trajectory: Trajectory
    calibration: Calibration
    windows: list[WindowRecord] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    timings: dict[str, float] = field(default_factory=dict)
    health: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    breaks: list[Break] = field(default_factory=list)
    segments: list[tuple[float, float]] = field(default_factory=list)
    covariances: PoseCovariances | None = None
    short_variances: NDArray[np.float64] | None = None

    @property
    def warnings(self) -> list[str]:
        """Sentences for the user: health, then the breaks."""
        return [*self.health, *(b.sentence() for b in self.breaks)]

    @property
    def spans(self) -> list[tuple[float, float]]:
        """First and last time of each stretch without a break, s; of the whole if none is named."""
        times = self.trajectory.times
        return self.segments or [(float(times[0]), float(times[-1]))]
