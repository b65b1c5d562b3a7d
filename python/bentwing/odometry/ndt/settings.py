# SPDX-License-Identifier: MIT OR Apache-2.0
"""Settings of the NDT odometry; the defaults serve every sensor and scene."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from bentwing.base.settings import Settings
from bentwing.base.units import Metres, Radians, Seconds  # noqa: TC001 - pydantic reads them


class NdtSettings(Settings):
    """NDT odometry against keyframes (Tazir 2020, algorithm 1)."""

    scan: Seconds = Field(
        default=0.1, ge=0.02, le=1.0, description="length of a scan: one revolution of the lidar"
    )
    voxel_size: Metres = Field(
        default=1.0,
        gt=0.05,
        le=10.0,
        description="edge of the finest voxels; each further level doubles it",
    )
    n_levels: int = Field(default=3, ge=1, le=6, description="number of voxel levels")
    max_points: int = Field(
        default=4000, ge=100, le=1_000_000, description="most points of a scan that are registered"
    )
    keyframe_distance: Metres = Field(
        default=0.5, ge=0, le=1e6, description="motion of the lidar that makes a scan a keyframe"
    )
    keyframe_angle: Radians = Field(
        default=0.1, ge=0, le=10, description="turn of the lidar that makes a scan a keyframe"
    )
    reference: Literal["keyframes", "last"] = Field(
        default="keyframes",
        description="what scans are registered to: all keyframes in reach of the lidar, or the last one",
    )
