# SPDX-License-Identifier: MIT OR Apache-2.0
"""What works while the carrier moves: live odometry, control of carrier and head, planning."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.flight.control.bumper import (
        BumperCommand,
        BumperSettings,
        CarrierState,
        VirtualBumper,
    )
    from bentwing.flight.control.link import FlightLink
    from bentwing.flight.control.mavlink import MavlinkLink
    from bentwing.flight.control.spin_controller import SpinCommand, SpinController, SpinSettings
    from bentwing.flight.control.spin_target import SpinTarget
    from bentwing.flight.foxglove_server import FoxgloveServer
    from bentwing.flight.live.live_map import MapUpdate
    from bentwing.flight.live.odometry import Odometry
    from bentwing.flight.live.prediction import StampedPose
    from bentwing.flight.live.status import Status
    from bentwing.flight.plan.plan import Intent, Plan, plan_flight
    from bentwing.odometry.stall import Stall, StallWatch
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "flight.control.bumper": [
                "BumperCommand",
                "BumperSettings",
                "CarrierState",
                "VirtualBumper",
            ],
            "flight.control.link": ["FlightLink"],
            "flight.control.mavlink": ["MavlinkLink"],
            "flight.control.spin_controller": ["SpinCommand", "SpinController", "SpinSettings"],
            "flight.control.spin_target": ["SpinTarget"],
            "flight.foxglove_server": ["FoxgloveServer"],
            "flight.live.live_map": ["MapUpdate"],
            "flight.live.odometry": ["Odometry"],
            "flight.live.prediction": ["StampedPose"],
            "flight.live.status": ["Status"],
            "flight.plan.plan": ["Intent", "Plan", "plan_flight"],
            "odometry.stall": ["Stall", "StallWatch"],
        },
    )

__all__ = [
    "BumperCommand",
    "BumperSettings",
    "CarrierState",
    "FlightLink",
    "FoxgloveServer",
    "Intent",
    "MapUpdate",
    "MavlinkLink",
    "Odometry",
    "Plan",
    "SpinCommand",
    "SpinController",
    "SpinSettings",
    "SpinTarget",
    "Stall",
    "StallWatch",
    "StampedPose",
    "Status",
    "VirtualBumper",
    "plan_flight",
]
