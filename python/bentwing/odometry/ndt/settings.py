# SPDX-License-Identifier: MIT OR Apache-2.0
"""Settings of the NDT odometry; the defaults serve every sensor and scene."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class NdtSettings(BaseModel):
    """NDT odometry against keyframes (Tazir 2020, algorithm 1)."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    scan: float = Field(
        0.1, ge=0.02, le=1.0, description="length of a scan, s: a revolution of the lidar"
    )
    voxel_size: float = Field(
        1.0, gt=0.05, le=10.0, description="finest level, m; each further level doubles"
    )
    n_levels: int = Field(3, ge=1, le=6)
    max_points: int = Field(4000, ge=100, description="of a scan that are registered, at most")
    keyframe_distance: float = Field(
        0.5, ge=0, description="motion that makes a scan a keyframe, m"
    )
    keyframe_angle: float = Field(
        0.1, ge=0, description="turn of the lidar that makes a scan a keyframe, rad"
    )
    reference: Literal["keyframes", "last"] = Field(
        "keyframes", description="all keyframes in reach of the lidar, or the last one alone"
    )
