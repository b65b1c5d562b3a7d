# SPDX-License-Identifier: MIT OR Apache-2.0
"""The error-state iterated Kalman filter for motor-turned and fixed 3D lidars (Fu 2023)."""

from __future__ import annotations

from bentwing.odometry.kalman.estimator import Kalman
from bentwing.odometry.kalman.settings import KalmanSettings

__all__ = ["Kalman", "KalmanSettings"]
