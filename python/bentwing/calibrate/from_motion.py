# SPDX-License-Identifier: MIT OR Apache-2.0
"""What only motion tells: how the IMU sits on the carrier, and the clocks of IMU and lidar."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from bentwing import odometry
from bentwing.odometry.continuous.settings import ContinuousSettings

if TYPE_CHECKING:
    from bentwing.base.calibration import Calibration
    from bentwing.base.progress import Stage
    from bentwing.recording.preprocess import RecordingPart


def calibrate_in_motion(
    part: RecordingPart, shown: Stage, *, motor_is_known: bool, threads: int | None = None
) -> Calibration:
    """Return the slow states of the continuous estimator at the end of a recording with motion.

    Parameters
    ----------
    part : with the payload to begin with
    motor_is_known : whether the lidar's place on the motor is held as the payload has it
    threads : of the estimator

    Raises
    ------
    EstimationError
        The recording cannot be followed.
    """
    frozen = ("motor_tilt", "motor_offset") if motor_is_known else ()
    engine = odometry.create("continuous", part.payload, ContinuousSettings(frozen=frozen), threads)
    for batch in part.batches(shown, Counter()):
        engine.feed(batch)
    return engine.result().calibration
