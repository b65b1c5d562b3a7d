# SPDX-License-Identifier: MIT OR Apache-2.0
"""The estimators: batches in, a trajectory with its calibration and health out."""

from bentwing.odometry.continuous.estimator import Continuous
from bentwing.odometry.kalman import Kalman
from bentwing.odometry.ndt import Ndt
from bentwing.odometry.registry import ESTIMATORS, EstimatorSettings, create, require_estimator

__all__ = [
    "ESTIMATORS",
    "Continuous",
    "EstimatorSettings",
    "Kalman",
    "Ndt",
    "create",
    "require_estimator",
]
