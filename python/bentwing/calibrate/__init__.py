# SPDX-License-Identifier: MIT OR Apache-2.0
"""Calibration of a sensor head: the lidar on its motor, the IMU, the clocks."""

from bentwing.calibrate.calibrate import calibrate
from bentwing.calibrate.folder import CalibrationFolder
from bentwing.calibrate.outcome import Calibrated

__all__ = ["Calibrated", "CalibrationFolder", "calibrate"]
