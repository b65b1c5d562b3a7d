# SPDX-License-Identifier: MIT OR Apache-2.0
"""Settings of the continuous estimator; the defaults serve every sensor and scene."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, field_validator

from bentwing.base.settings import Settings
from bentwing.base.units import Metres, Radians, Seconds, Unit
from bentwing.odometry.continuous.slow_states import SLICES


def known_states(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return names of slow states.

    Raises
    ------
    ValueError
        There is no such state.
    """
    unknown = sorted(set(names) - SLICES.keys())
    if unknown:
        msg = f"unknown states {unknown}; choose from {list(SLICES)}"
        raise ValueError(msg)
    return names


class SurfelSettings(Settings):
    """What makes a surfel (Kaul 2015, section 2.1)."""

    voxel_size: Metres = Field(
        default=0.4,
        ge=0.01,
        le=100,
        description="edge of the finest voxels; each further level doubles it",
    )
    n_levels: int = Field(default=4, ge=1, le=8, description="number of voxel levels")
    max_gap: Seconds = Field(
        default=0.08, gt=0, le=60, description="pause beyond which a voxel's points are split"
    )
    max_span: Seconds = Field(default=0.3, gt=0, le=60, description="longest time in a surfel")
    min_points: int = Field(default=6, ge=4, le=10_000, description="fewest points of a surfel")
    min_planarity: float = Field(
        default=0.3, ge=0, le=1, description="least 2 (λ2 - λ1) / (λ1 + λ2 + λ3) of a surfel"
    )
    min_width_ratio: float = Field(
        default=0.03, ge=0, le=1, description="least λ2 / λ3 of a surfel"
    )
    min_width: float = Field(
        default=0.05,
        ge=0,
        le=1,
        description="least √λ2 of a surfel, in voxels; rejects single scan lines",
    )
    min_incidence_cosine: float = Field(
        default=0.1,
        ge=0,
        lt=1,
        description="least cosine between normal and ray; rejects the plane of the scan itself",
    )
    max_rate: Annotated[float, Unit("1/s")] = Field(
        default=1500.0, ge=1, le=100_000, description="most surfels per second of data"
    )


class RegistrationSettings(Settings):
    """How a window is registered (Kaul 2015, section 2.1)."""

    knot_interval: Seconds = Field(
        default=0.2, ge=0.05, le=1e6, description="time between knots of the correction spline"
    )
    n_neighbors: int = Field(
        default=2, ge=1, le=32, description="nearest neighbours that a surfel is matched with"
    )
    max_match_distance: float = Field(
        default=1.0, gt=0, le=1, description="largest distance of a match in feature space"
    )
    min_match_gap: Seconds = Field(
        default=0.3, ge=0, le=60, description="least difference in time of a match"
    )
    first_cauchy_scale: float = Field(
        default=3.0,
        ge=0.01,
        le=1000,
        description="scale of the robust loss in the first outer iteration, in standard deviations",
    )
    cauchy_scale: float = Field(
        default=1.0, ge=0.01, le=1000, description="the same in later outer iterations"
    )
    max_outer: int = Field(
        default=20,
        ge=1,
        le=1000,
        description="most outer iterations; a window that follows a gap needs many",
    )
    n_inner: int = Field(default=1, ge=1, le=100, description="solutions per outer iteration")
    min_translation: Metres = Field(
        default=2e-3, gt=0, le=10, description="smaller steps of the position end the iterations"
    )
    min_rotation: Radians = Field(
        default=2e-4, gt=0, le=1, description="smaller steps of the rotation end the iterations"
    )
    velocity_sigma: Annotated[float, Unit("m/s")] = Field(
        default=0.5,
        ge=1e-6,
        le=1e6,
        description="expected deviation of the velocity from the prior",
    )
    rate_sigma: Annotated[float, Unit("rad/s")] = Field(
        default=0.5,
        ge=1e-6,
        le=1e6,
        description="expected deviation of the angular rate from the prior",
    )
    motion_accel_density: Annotated[float, Unit("m/s²/√Hz")] = Field(
        default=1.5,
        ge=1e-6,
        le=1e6,
        description="how hard the carrier accelerates, where no IMU says it",
    )
    motion_angular_density: Annotated[float, Unit("rad/s²/√Hz")] = Field(
        default=1.0, ge=1e-6, le=1e6, description="the same of rotation"
    )


class ContinuousSettings(Settings):
    """The sliding window of the continuous estimator."""

    window: Seconds = Field(default=5.0, ge=0.5, le=60, description="length of the sliding window")
    shift: Seconds = Field(
        default=1.5, ge=0.05, le=60, description="new data per step of the window"
    )
    window_without_imu: Seconds = Field(
        default=2.0, ge=0.5, le=60, description="length of the window without an IMU"
    )
    shift_without_imu: Seconds = Field(
        default=0.2,
        ge=0.05,
        le=60,
        description="new data per step without an IMU: how long velocities are extrapolated",
    )
    view_length: Seconds = Field(default=1.5, gt=0, le=60, description="length of a fixed view")
    view_distance: Metres = Field(
        default=1.5, gt=0, le=1e6, description="motion that renews the fixed views"
    )
    n_views: int = Field(default=5, ge=0, le=1000, description="number of fixed views in a window")
    frozen: tuple[str, ...] = Field(
        default=(),
        description="slow states that are not estimated, such as `latency`, `extrinsic_rotation`",
    )
    surfels: SurfelSettings = Field(default=SurfelSettings(), description="what makes a surfel")
    registration: RegistrationSettings = Field(
        default=RegistrationSettings(), description="how a window is registered"
    )

    _known_states = field_validator("frozen")(known_states)

    def without_imu(self) -> ContinuousSettings:
        """Return the settings with the window that suits a lidar alone."""
        return self.model_copy(
            update={"window": self.window_without_imu, "shift": self.shift_without_imu}
        )
