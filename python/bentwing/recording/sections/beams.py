# SPDX-License-Identifier: MIT OR Apache-2.0
"""The section `lidar.beams`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from bentwing.base.units import Unit
from bentwing.recording.sections.section import Section

# Beyond that a table is that of another lidar.
LargeAngle = Annotated[float, Field(ge=-0.1, le=0.1, allow_inf_nan=False)]
Distance = Annotated[float, Field(ge=-1.0, le=1.0, allow_inf_nan=False)]
Elevation = Annotated[float, Field(ge=-1.6, le=1.6, allow_inf_nan=False)]


class Beams(Section):
    """What is added to each return of a multi-beam lidar, by its beam.

    Values stand in the order of the beams' numbers, which are those of the recording's field `ring`
    or, where it has none, those of `table`. A list that is left out changes nothing.

    Attributes
    ----------
    elevations, azimuths : rad, true less recorded; upwards and to the left are positive
    ranges : m, true less recorded
    heights : m, of where each ray begins, above the origin of the lidar frame; the blocks of lasers
        of a HDL-64 are 9 cm apart
    table : rad, elevations as the recording has them; needed where it has no rings
    """

    elevations: Annotated[tuple[LargeAngle, ...], Unit("rad")] = ()
    azimuths: Annotated[tuple[LargeAngle, ...], Unit("rad")] = ()
    ranges: Annotated[tuple[Distance, ...], Unit("m")] = ()
    heights: Annotated[tuple[Distance, ...], Unit("m")] = ()
    table: Annotated[tuple[Elevation, ...], Unit("rad")] = ()

    @model_validator(mode="after")
    def _as_many(self) -> Beams:
        counts = {name: len(value) for name, value in self if value}
        if len(set(counts.values())) > 1:
            found = ", ".join(f"{n} {name}" for name, n in counts.items())
            msg = f"needs as many values in each list, has {found}"
            raise ValueError(msg)
        return self

    @property
    def n_beams(self) -> int:
        """Number of beams."""
        return max(
            len(v) for v in (self.elevations, self.azimuths, self.ranges, self.heights, self.table)
        )
