# SPDX-License-Identifier: MIT OR Apache-2.0
"""Live use: batches as the sensors deliver them in, the pose now and the map so far out.

What acts on the flight is here under one name with it: `SpinController`, `VirtualBumper`, `StallWatch`.
"""

from bentwing.flight.control import (
    BumperCommand,
    BumperSettings,
    CarrierState,
    SpinCommand,
    SpinController,
    SpinSettings,
    SpinTarget,
    Stall,
    StallWatch,
    VirtualBumper,
)
from bentwing.flight.live.live_map import MapUpdate
from bentwing.flight.live.odometry import Odometry
from bentwing.flight.live.prediction import StampedPose
from bentwing.flight.live.status import Status

__all__ = [
    "BumperCommand",
    "BumperSettings",
    "CarrierState",
    "MapUpdate",
    "Odometry",
    "SpinCommand",
    "SpinController",
    "SpinSettings",
    "SpinTarget",
    "Stall",
    "StallWatch",
    "StampedPose",
    "Status",
    "VirtualBumper",
]
