# SPDX-License-Identifier: MIT OR Apache-2.0
"""What controllers exchange with an autopilot, whoever carries it: MAVLink, a ROS node, a simulation.

Body x forward, y left, z up; roll to the right and pitch forward (nose down) are positive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from bentwing.flight.control.springs import Springs


@dataclass(frozen=True, slots=True)
class Attitude:
    """Attitude of the carrier, rad, at a time of the autopilot's clock, s; yaw to the left."""

    time: float
    roll: float
    pitch: float
    yaw: float


@dataclass(frozen=True, slots=True)
class Distance:
    """Reading of a distance sensor, m; `is_downward` tells a height above ground."""

    time: float
    distance: float
    is_downward: bool


@dataclass(frozen=True, slots=True)
class Sticks:
    """The pilot's wishes, −1 … 1: roll to the right, pitch forward; thrust 0 … 1."""

    roll: float
    pitch: float
    thrust: float


Message = Attitude | Distance | Sticks


class FlightLink(Protocol):
    """A connection to the autopilot; implement it over ROS topics, and the rest does not change."""

    def receive(self) -> list[Message]:
        """Return what has come since the last call, oldest first, without waiting."""
        ...

    def send_attitude(self, roll: float, pitch: float, yaw: float, thrust: float) -> None:
        """Command an attitude (rad) and a thrust 0 … 1."""
        ...

    def send_gaps(self, springs: Springs, yaw: float) -> None:
        """Tell the gaps around the hull, for the pilot's display and the autopilot's own safety."""
        ...

    def send_warning(self, sentence: str) -> None:
        """Tell the pilot something in at most 50 characters."""
        ...
