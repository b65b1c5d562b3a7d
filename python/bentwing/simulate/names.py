# SPDX-License-Identifier: MIT OR Apache-2.0
"""The names that a scenario chooses from, apart so that a help page shows them at once."""

from __future__ import annotations

from typing import Literal, TypeAlias

SceneName: TypeAlias = Literal[
    "courtyard", "compound", "office", "forest", "cave", "mine", "town", "walls", "dam",
    "mocap", "carpark", "campus", "street",
]  # fmt: skip
HeadName: TypeAlias = Literal[
    "hokuyo-spin", "hokuyo-nod", "vlp16-fixed", "vlp16-side", "vlp16-motor", "hdl64", "os1-64"
]
CAR_HEADS = ("hdl64", "os1-64")
"""Heads on the roof of a car, which drives on a road."""
SpinName: TypeAlias = Literal["steady", "plant"]
RealismGroup: TypeAlias = Literal[
    "stamps", "ranges", "imu", "mount", "motor", "shocks", "scene", "payload"
]
FlightName: TypeAlias = Literal["tour", "survey", "stand", "drive"]
RecordingFormat: TypeAlias = Literal["bag", "mcap", "db3"]
ReceiverName: TypeAlias = Literal["rtk", "single"]
EventName: TypeAlias = Literal[
    "spin-stall",
    "gusts",
    "person",
    "dropped-packets",
    "strong-bias",
    "motion-start",
    "gap",
    "motor-reversal",
]
