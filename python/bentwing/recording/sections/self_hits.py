# SPDX-License-Identifier: MIT OR Apache-2.0
"""The section `self_hits`."""

from __future__ import annotations

from pydantic import model_validator

from bentwing.recording.sections.section import Lever, Section


class Box(Section):
    """Axis-aligned box in the lidar frame.

    Attributes
    ----------
    min, max : m, lowest and highest corner x y z
    """

    min: Lever
    max: Lever

    @model_validator(mode="after")
    def _has_volume(self) -> Box:
        if any(low >= high for low, high in zip(self.min, self.max, strict=True)):
            msg = f"min {list(self.min)} must be below max {list(self.max)} on every axis"
            raise ValueError(msg)
        return self


class SelfHit(Section):
    """A region in the lidar frame where returns are from the carrier itself.

    Attributes
    ----------
    box : the region
    """

    box: Box
