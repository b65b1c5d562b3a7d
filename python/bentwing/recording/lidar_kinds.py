# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a payload may call a lidar, and what is assumed of its kind: usable ranges and noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

LidarKind = Literal["hokuyo-utm30lx", "vlp16", "ouster", "livox", "hesai", "robosense", "generic"]
# The models whose raw packets can be read; needed where the packets do not tell.
VelodyneModel = Literal["hdl32e", "vlp16", "puck-hires", "vlp32a", "vlp32b", "vlp32c", "vls128"]
RobosenseModel = Literal["rs16", "rs32", "helios", "airy"]
PacketModel = Literal[VelodyneModel, RobosenseModel]


@dataclass(frozen=True, slots=True)
class KindDefaults:
    """Usable ranges and range noise of one kind of lidar, all in m."""

    min_range: float
    max_range: float
    range_sigma: float


# Cautious round figures of the order the makers give; a payload file overrides each of them.
KIND_DEFAULTS: dict[LidarKind, KindDefaults] = {
    "hokuyo-utm30lx": KindDefaults(0.3, 30.0, 0.015),
    "vlp16": KindDefaults(0.5, 100.0, 0.02),
    "ouster": KindDefaults(0.5, 100.0, 0.02),
    "livox": KindDefaults(0.3, 100.0, 0.02),
    "hesai": KindDefaults(0.3, 120.0, 0.02),
    "robosense": KindDefaults(0.4, 120.0, 0.02),
    "generic": KindDefaults(0.3, 100.0, 0.02),
}
