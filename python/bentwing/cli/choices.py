# SPDX-License-Identifier: MIT OR Apache-2.0
"""The names that options choose from.

A help page shows them without importing what they stand for; a test compares them with that.
"""

from __future__ import annotations

from enum import Enum
from typing import Literal

EstimatorName = Literal["continuous", "kalman", "ndt"]
MapFormat = Literal["laz", "las", "ply", "pcd", "e57"]
GeoreferenceMode = Literal["rigid", "constraints", "off"]
PaperName = Literal["kaul2015", "fu2023", "tazir2020"]


SceneName = Literal[
    "courtyard", "compound", "office", "forest", "cave", "mine", "town", "walls", "dam",
    "mocap", "carpark", "campus",
]  # fmt: skip
HeadName = Literal["hokuyo-spin", "hokuyo-nod", "vlp16-fixed", "vlp16-side", "vlp16-motor"]
SpinName = Literal["steady", "plant"]
FlightName = Literal["tour", "survey", "stand"]
RecordingFormat = Literal["bag", "mcap", "db3"]
ReceiverName = Literal["rtk", "single"]


# typer takes lists of enumerations, but not of literals.
class PartName(str, Enum):
    """A part of a paper."""

    MAPPING = "mapping"
    FLIGHT = "flight"


class EventName(str, Enum):
    """What goes wrong in a simulated recording."""

    SPIN_STALL = "spin-stall"
    GUSTS = "gusts"
    PERSON = "person"
    DROPPED_PACKETS = "dropped-packets"
    STRONG_BIAS = "strong-bias"
    MOTION_START = "motion-start"
    GAP = "gap"
    MOTOR_REVERSAL = "motor-reversal"
