# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the passes over a recording say, as an `Estimate`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.calibration import STANDARD_GRAVITY, Calibration
from bentwing.base.estimate import Estimate
from bentwing.base.trajectory import DT
from bentwing.odometry.continuous.odometry_pass import MARGIN
from bentwing.odometry.continuous.slow_states import named_std
from bentwing.odometry.core_states import refined_mount
from bentwing.odometry.segments import joined

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.base.breaks import Break
    from bentwing.base.mount import Mount
    from bentwing.base.window_record import WindowRecord
    from bentwing.odometry.continuous.odometry_pass import OdometryPass


def estimate_of(
    passes: Sequence[OdometryPass], described: Mount, breaks: Sequence[Break]
) -> Estimate:
    """Return what passes that follow each other say, levelled.

    Parameters
    ----------
    passes : at least one; between two of them the recording breaks
    described : the mount as the payload has it
    breaks : that were judged
    """
    segments, last = [p.trajectory() for p in passes], passes[-1]
    windows = [w for p in passes for w in p.windows]
    n_blind = sum(p.n_blind for p in passes)
    slow = last.globals
    calibration = Calibration(
        latency=slow.latency,
        mount=refined_mount(described, slow),
        gyro_bias=slow.gyro_bias,
        accel_bias=slow.accel_bias,
        gravity=np.array([0.0, 0.0, STANDARD_GRAVITY]),
        std=named_std(last.covariance, last.prior.frozen),
    )
    return Estimate(
        joined(segments),
        calibration,
        windows=windows,
        counts={
            "estimate.windows": len(windows),
            "estimate.samples_without_imu": n_blind,
        },
        timings={name: sum(p.timings[name] for p in passes) for name in last.timings},
        health=_health(windows, n_blind),
        breaks=[*breaks],
        segments=[(float(s.times[0]), float(s.times[-1])) for s in segments],
    )


def _health(windows: Sequence[WindowRecord], n_blind: int) -> list[str]:
    sentences = []
    degenerate = [w.time for w in windows if w.degenerate]
    if degenerate:
        sentences.append(
            f"{len(degenerate)} of {len(windows)} windows see too little in some direction "
            f"(first at {degenerate[0]:.1f} s): the IMU carries the estimate there"
        )
    # The trajectory is carried a little beyond the last stamps, always without data.
    if n_blind * DT > 2 * MARGIN:
        sentences.append(
            f"{n_blind * DT:.2f} s have no inertial data: the motion went on at constant velocity there"
        )
    return sentences
