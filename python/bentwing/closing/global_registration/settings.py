# SPDX-License-Identifier: MIT OR Apache-2.0
"""Settings of the global registration; the defaults serve every sensor and scene."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from bentwing.odometry.continuous.settings import RegistrationSettings, SurfelSettings


class GlobalSettings(BaseModel):
    """How a recording is closed with itself (Kaul 2015, section 2.2)."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    knot_interval: float = Field(
        1.0,
        gt=0,
        description="of the correction spline, s; what is faster the windows have settled",
    )
    max_knots: int = Field(1000, ge=4, description="of all together; a longer interval keeps to it")
    stretch: float = Field(5.0, gt=0, description="what is matched as one visit of a place, s")
    n_visits: int = Field(8, ge=0, description="other visits each stretch is matched with")
    min_overlap: float = Field(0.15, gt=0, lt=1, description="share of places seen by both")
    max_match_distance: float = Field(0.6, gt=0, le=1, description="in feature space")
    max_outer: int = Field(8, ge=1, description="most iterations")
    min_translation: float = Field(1e-3, gt=0, description="smaller steps end the iterations, m")
    min_rotation: float = Field(1e-4, gt=0, description="smaller steps end the iterations, rad")
    memory_mb: float = Field(
        2000.0, gt=0, description="what surfels and equations may take; surfels are thinned to fit"
    )
    surfels: SurfelSettings = SurfelSettings()

    def interval_for(self, seconds: float) -> float:
        """Return the knot interval, s, of a recording of this length.

        Drift over hours is slow; with a bounded number of knots the equations stay within memory and
        their solution within time.
        """
        return max(self.knot_interval, seconds / self.max_knots)

    def registration(self, seconds: float) -> RegistrationSettings:
        """Return the settings of the core's rows and iterations for a length in s."""
        return RegistrationSettings(
            knot_interval=self.interval_for(seconds),
            max_match_distance=self.max_match_distance,
            max_outer=self.max_outer,
            min_translation=self.min_translation,
            min_rotation=self.min_rotation,
        )
