# SPDX-License-Identifier: MIT OR Apache-2.0
"""Settings of the Kalman filter; the defaults serve every sensor and scene."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from bentwing.base.settings import Settings
from bentwing.base.units import Metres, Seconds, Unit


class KalmanSettings(Settings):
    """The error-state iterated Kalman filter (Fu 2023, section 2.3)."""

    scan: Seconds = Field(
        default=0.1, ge=0.02, le=1.0, description="length of the lidar data per update"
    )
    voxel_size: Metres = Field(
        default=0.5,
        gt=0.05,
        le=10.0,
        description="edge of the map's finest voxels; each further level doubles it",
    )
    n_levels: int = Field(default=3, ge=1, le=6, description="number of voxel levels")
    max_features: int = Field(
        default=1500, ge=50, le=100_000, description="most planar features of an update"
    )
    max_iterations: int = Field(default=4, ge=1, le=20, description="most iterations of an update")
    edges: bool = Field(default=True, description="whether to use depth edges beside planes")
    rotation: Literal["encoder", "ignored"] = Field(
        default="encoder",
        description="how a motor's rotation enters; `ignored` takes a turning lidar for a fixed one, "
        "as FAST-LIO would",
    )
    rehearsal: Seconds = Field(
        default=12.0,
        ge=0.0,
        le=3600.0,
        description="time after which the filter begins again with the mount it has learned; 0: never",
    )
    odometry_rate: Annotated[float, Unit("Hz")] = Field(
        default=50.0, ge=10.0, le=1000.0, description="rate of the predicted poses between updates"
    )
    smoothing: float = Field(
        default=0.62,
        ge=0.001,
        le=1.0,
        description="low-pass factor of the smoothed odometry; 1: none",
    )
