# SPDX-License-Identifier: MIT OR Apache-2.0
"""Settings of the continuous estimator; the defaults serve every sensor and scene."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field, field_validator

from bentwing.odometry.continuous.slow_states import SLICES


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class SurfelSettings(_Section):
    """What makes a surfel (Kaul 2015, section 2.1)."""

    voxel_size: float = Field(0.4, gt=0, description="finest level, m; each further level doubles")
    n_levels: int = Field(4, ge=1, le=8)
    max_gap: float = Field(0.08, gt=0, description="a longer pause splits a cell, s")
    max_span: float = Field(0.3, gt=0, description="longest time in a surfel, s")
    min_points: int = Field(6, ge=4)
    min_planarity: float = Field(0.3, ge=0, le=1, description="2 (l2 - l1) / (l1 + l2 + l3)")
    min_width_ratio: float = Field(0.03, ge=0, le=1, description="l2 / l3")
    min_width: float = Field(
        0.05, ge=0, description="sqrt(l2) in voxels; rejects single scan lines"
    )
    min_incidence_cosine: float = Field(
        0.1, ge=0, lt=1, description="between normal and ray; rejects the plane of the scan itself"
    )
    max_rate: float = Field(1500.0, gt=0, description="most surfels per second of data")


class RegistrationSettings(_Section):
    """How a window is registered (Kaul 2015, section 2.1)."""

    knot_interval: float = Field(0.2, gt=0, description="of the correction spline, s")
    n_neighbors: int = Field(2, ge=1)
    max_match_distance: float = Field(1.0, gt=0, le=1, description="in feature space")
    min_match_gap: float = Field(0.3, ge=0, description="least difference in time of matches, s")
    first_cauchy_scale: float = Field(3.0, gt=0, description="first outer iteration, sigmas")
    cauchy_scale: float = Field(1.0, gt=0, description="later outer iterations, sigmas")
    max_outer: int = Field(20, ge=1, description="a window that follows a gap needs many")
    n_inner: int = Field(1, ge=1)
    min_translation: float = Field(2e-3, gt=0, description="smaller steps end the iterations, m")
    min_rotation: float = Field(2e-4, gt=0, description="smaller steps end the iterations, rad")
    velocity_sigma: float = Field(0.5, gt=0, description="deviation from the prior, m/s")
    rate_sigma: float = Field(0.5, gt=0, description="deviation from the prior, rad/s")
    motion_accel_density: float = Field(1.5, gt=0, description="without IMU, m/s²/√Hz")
    motion_angular_density: float = Field(1.0, gt=0, description="without IMU, rad/s²/√Hz")


class ContinuousSettings(_Section):
    """The sliding window of the continuous estimator."""

    window: float = Field(5.0, gt=0, description="length, s")
    shift: float = Field(1.5, gt=0, description="new data per step, s")
    window_without_imu: float = Field(2.0, gt=0, description="length without an IMU, s")
    shift_without_imu: float = Field(
        0.2,
        gt=0,
        description="new data per step without an IMU, s: how long velocities are extrapolated",
    )
    view_length: float = Field(1.5, gt=0, description="of a fixed view, s")
    view_distance: float = Field(1.5, gt=0, description="motion that renews the fixed views, m")
    n_views: int = Field(5, ge=0, description="fixed views in a window")
    frozen: tuple[str, ...] = Field(
        (), description="slow states that are not estimated: latency, extrinsic_rotation, …"
    )
    surfels: SurfelSettings = SurfelSettings()
    registration: RegistrationSettings = RegistrationSettings()

    @field_validator("frozen")
    @classmethod
    def _known_states(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        unknown = sorted(set(names) - SLICES.keys())
        if unknown:
            msg = f"unknown states {unknown}; choose from {list(SLICES)}"
            raise ValueError(msg)
        return names

    def without_imu(self) -> ContinuousSettings:
        """Return the settings with the window that suits a lidar alone."""
        return self.model_copy(
            update={"window": self.window_without_imu, "shift": self.shift_without_imu}
        )
