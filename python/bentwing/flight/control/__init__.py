# SPDX-License-Identifier: MIT OR Apache-2.0
"""What acts on the carrier and its head in flight: small, fast, and without the estimator."""

from bentwing.flight.control.bumper import (
    BumperCommand,
    BumperSettings,
    CarrierState,
    VirtualBumper,
)
from bentwing.flight.control.spin_controller import SpinCommand, SpinController, SpinSettings
from bentwing.flight.control.spin_target import SpinTarget
from bentwing.odometry.stall import Stall, StallWatch

__all__ = [
    "BumperCommand",
    "BumperSettings",
    "CarrierState",
    "SpinCommand",
    "SpinController",
    "SpinSettings",
    "SpinTarget",
    "Stall",
    "StallWatch",
    "VirtualBumper",
]
