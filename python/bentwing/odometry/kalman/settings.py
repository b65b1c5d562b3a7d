# SPDX-License-Identifier: MIT OR Apache-2.0
"""Settings of the Kalman filter; the defaults serve every sensor and scene."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class KalmanSettings(BaseModel):
    """The error-state iterated Kalman filter (Fu 2023, section 2.3)."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    scan: float = Field(0.1, ge=0.02, le=1.0, description="lidar data per update, s")
    voxel_size: float = Field(
        0.5, gt=0.05, le=10.0, description="finest level of the map, m; each further level doubles"
    )
    n_levels: int = Field(3, ge=1, le=6)
    max_features: int = Field(1500, ge=50, description="planar features of an update, at most")
    max_iterations: int = Field(4, ge=1, le=20)
    edges: bool = Field(default=True, description="whether depth edges take part beside planes")
    rotation: Literal["encoder", "ignored"] = Field(
        "encoder",
        description="`ignored` takes a turning lidar for a fixed one, as FAST-LIO would",
    )
    rehearsal: float = Field(
        12.0,
        ge=0.0,
        description="after so long begin again with what was learned of the mount, s; 0: never",
    )
    odometry_rate: float = Field(
        50.0, ge=10.0, le=1000.0, description="of the predicted poses between updates, Hz"
    )
    smoothing: float = Field(
        0.62, gt=0.0, le=1.0, description="low-pass factor of the smoothed odometry; 1: none"
    )
