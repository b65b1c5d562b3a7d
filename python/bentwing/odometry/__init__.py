# SPDX-License-Identifier: MIT OR Apache-2.0
"""The estimators: batches in, a trajectory with its calibration and health out."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.odometry.continuous.estimator import Continuous
    from bentwing.odometry.continuous.settings import (
        ContinuousSettings,
        RegistrationSettings,
        SurfelSettings,
    )
    from bentwing.odometry.interface import Estimator
    from bentwing.odometry.kalman.estimator import Kalman
    from bentwing.odometry.kalman.settings import KalmanSettings
    from bentwing.odometry.names import EstimatorName
    from bentwing.odometry.ndt.estimator import Ndt
    from bentwing.odometry.ndt.settings import NdtSettings
    from bentwing.odometry.registry import (
        ESTIMATORS,
        EstimatorSettings,
        create,
        require_estimator,
    )
    from bentwing.odometry.window import register_window
    from bentwing.odometry.window_result import FixedView, WindowResult
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "odometry.continuous.estimator": ["Continuous"],
            "odometry.continuous.settings": [
                "ContinuousSettings",
                "RegistrationSettings",
                "SurfelSettings",
            ],
            "odometry.interface": ["Estimator"],
            "odometry.kalman.estimator": ["Kalman"],
            "odometry.kalman.settings": ["KalmanSettings"],
            "odometry.names": ["EstimatorName"],
            "odometry.ndt.estimator": ["Ndt"],
            "odometry.ndt.settings": ["NdtSettings"],
            "odometry.registry": [
                "ESTIMATORS",
                "EstimatorSettings",
                "create",
                "require_estimator",
            ],
            "odometry.window": ["register_window"],
            "odometry.window_result": ["FixedView", "WindowResult"],
        },
    )

__all__ = [
    "ESTIMATORS",
    "Continuous",
    "ContinuousSettings",
    "Estimator",
    "EstimatorName",
    "EstimatorSettings",
    "FixedView",
    "Kalman",
    "KalmanSettings",
    "Ndt",
    "NdtSettings",
    "RegistrationSettings",
    "SurfelSettings",
    "WindowResult",
    "create",
    "register_window",
    "require_estimator",
]
