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
FaultName: TypeAlias = Literal[
    "mount-90-x", "mount-90-y", "mount-90-z", "mount-180-x", "mount-180-y", "mount-180-z",
    "mount-wxyz", "mount-tilted", "mount-random",
    "gyro-swapped", "gyro-cyclic", "gyro-one-negated", "gyro-negated", "gyro-zero",
    "gyro-constant", "gyro-saturated", "gyro-1.2", "gyro-2", "gyro-degrees",
    "accel-swapped", "accel-cyclic", "accel-one-negated", "accel-negated", "accel-g",
    "accel-milli-g", "accel-no-gravity",
    "imu-cyclic", "imu-left-handed", "imu-of-another", "imu-frozen", "imu-10hz", "elevator",
    "lidar-late-0.05", "lidar-early-0.05", "lidar-late-0.5", "lidar-early-0.5",
    "lidar-late-1", "lidar-early-1", "lidar-late-3", "lidar-early-3",
    "lidar-power-on", "imu-power-on", "lidar-drifting",
    "lidar-mirrored", "lidar-upside-down", "ranges-1.3", "ranges-millimetres", "ranges-random",
    "ranges-constant", "points-shuffled", "lidar-level",
    "encoder-degrees", "encoder-negated", "encoder-turned", "encoder-late", "encoder-axis",
    "encoder-second",
    "times-none", "times-none-end",
]  # fmt: skip
