# SPDX-License-Identifier: MIT OR Apache-2.0
"""Live use: batches as the sensors deliver them in, the pose now and the map so far out."""

from bentwing.live.live_map import MapUpdate
from bentwing.live.odometry import Odometry
from bentwing.live.prediction import StampedPose
from bentwing.live.status import Status

__all__ = ["MapUpdate", "Odometry", "StampedPose", "Status"]
