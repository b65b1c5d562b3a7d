# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is wrong with ranges in the same way each time, and does not average out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True, slots=True)
class RangeBias:
    """A range r at the angle of incidence θ is too long by `offset + grazing · r · tan θ`.

    A scale is none of it: with it the whole world would be larger, and nothing that the lidar sees says
    so. The lidar is the standard of length.

    Attributes
    ----------
    offset : m
    grazing : rad, the share of a beam's width by which its echo from a slanted surface is late
    """

    offset: float = 0.0
    grazing: float = 0.0

    def to_json(self) -> dict[str, float]:
        """Return the bias as run.json has it."""
        return {"offset": self.offset, "grazing": self.grazing}

    @classmethod
    def from_json(cls, described: Mapping[str, float] | None) -> RangeBias:
        """Read the bias in a run.json; earlier versions have none."""
        return cls() if described is None else cls(described["offset"], described["grazing"])
