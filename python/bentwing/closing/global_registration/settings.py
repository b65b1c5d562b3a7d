# SPDX-License-Identifier: MIT OR Apache-2.0
"""Settings of the global registration; the defaults serve every sensor and scene."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, field_validator

from bentwing.base.settings import Settings
from bentwing.base.units import Metres, Radians, Seconds, Unit
from bentwing.odometry.continuous.settings import RegistrationSettings, SurfelSettings, known_states


class GlobalSettings(Settings):
    """How a recording is closed with itself (Kaul 2015, section 2.2)."""

    knot_interval: Seconds = Field(
        default=1.0,
        ge=0.05,
        le=600,
        description="time between knots of the correction spline; the windows have settled what is "
        "faster",
    )
    max_knots: int = Field(
        default=1000,
        ge=4,
        le=100_000,
        description="most knots in all; long recordings get a longer interval",
    )
    stretch: Seconds = Field(
        default=5.0,
        ge=0.1,
        le=600,
        description="length of the data that is matched as one visit of a place",
    )
    n_visits: int = Field(
        default=8,
        ge=0,
        le=1000,
        description="number of other visits that each stretch is matched with",
    )
    min_overlap: float = Field(
        default=0.15,
        gt=0,
        lt=1,
        description="least share of a stretch's places that another visit must have seen",
    )
    max_match_distance: float = Field(
        default=0.6, gt=0, le=1, description="largest distance of a match in feature space"
    )
    max_outer: int = Field(default=8, ge=1, le=1000, description="most outer iterations")
    min_translation: Metres = Field(
        default=1e-3, gt=0, le=10, description="smaller steps of the position end the iterations"
    )
    min_rotation: Radians = Field(
        default=1e-4, gt=0, le=1, description="smaller steps of the rotation end the iterations"
    )
    memory_mb: Annotated[float, Unit("MB")] = Field(
        default=2000.0,
        ge=10,
        le=1e6,
        description="memory of surfels and equations; surfels are thinned to fit",
    )
    frozen: tuple[str, ...] = Field(
        default=(),
        description="slow states that stay as the estimate has them, such as `range_offset`",
    )
    surfels: SurfelSettings = Field(default=SurfelSettings(), description="what makes a surfel")

    _known_states = field_validator("frozen")(known_states)

    def interval_for(self, seconds: float) -> float:
        """Return the knot interval, s, of a recording of this length.

        Drift over hours is slow; with a bounded number of knots the equations stay within memory and
        their solution within time.
        """
        return max(self.knot_interval, seconds / self.max_knots)

    def posterior_interval_for(self, seconds: float) -> float:
        """Return the interval, s, of the knots by which covariances of the poses are computed.

        As that of the windows, as long as there are not too many.
        """
        return max(RegistrationSettings().knot_interval, seconds / self.max_knots)

    def registration(self, seconds: float) -> RegistrationSettings:
        """Return the settings of the core's rows and iterations for a length in s."""
        return RegistrationSettings(
            knot_interval=self.interval_for(seconds),
            max_match_distance=self.max_match_distance,
            max_outer=self.max_outer,
            min_translation=self.min_translation,
            min_rotation=self.min_rotation,
        )
