# SPDX-License-Identifier: MIT OR Apache-2.0
"""The section `lidar.ranges`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from bentwing.base.range_bias import RangeBias
from bentwing.base.units import Unit
from bentwing.recording.sections.section import Section


class Ranges(Section):
    """By how much a range r at the angle of incidence θ is too long: `offset + grazing · r · tan θ`.

    Attributes
    ----------
    offset : m
    grazing : rad, the share of a beam's width by which its echo from a slanted surface is late
    """

    offset: Annotated[float, Field(ge=-1.0, le=1.0, allow_inf_nan=False), Unit("m")] = 0.0
    grazing: Annotated[float, Field(ge=-0.1, le=0.1, allow_inf_nan=False), Unit("rad")] = 0.0

    @property
    def bias(self) -> RangeBias:
        """The same as estimators take it."""
        return RangeBias(self.offset, self.grazing)
