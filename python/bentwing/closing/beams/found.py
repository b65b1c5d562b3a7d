# SPDX-License-Identifier: MIT OR Apache-2.0
"""By how much the beams of a lidar are off, as a value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.value import Value
from bentwing.recording.sections.beams import Beams

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bentwing.recording import Payload

    Array = NDArray[np.float64]

NAMES = ("elevations", "azimuths", "ranges", "heights")
"""Of the columns, as in `lidar.beams`."""
LEAST = np.array([np.radians(0.015), np.radians(0.015), 1.5e-3, 5e-3])
"""rad and m; beams that are off by less in the mean are as good as the estimate of them."""
WORTH = 0.97
"""Thickness of surfaces by the beams that were found, as a share of that by those recorded: real errors leave
0.4 to 0.96 of it, what a cave feigns 0.985 and more, and that shrinks a climb by hundredths."""
DIGITS = 6


def are_off(offsets: Array) -> bool:
    """Whether beams (B, 4) are off by more in the mean than they can be known."""
    return bool((_rms(offsets) > LEAST).any())


def _rms(offsets: Array) -> Array:
    rms: Array = np.sqrt((offsets**2).mean(axis=0))
    return rms


@dataclass(frozen=True, slots=True, eq=False)
class FoundBeams(Value):
    """What the beams of a lidar are off.

    Attributes
    ----------
    offsets : (B, 4) to be added to elevation and azimuth, rad, range and height, m
    std : (B, 4) their standard deviations
    table : (B,) rad, elevation of each beam as it is recorded
    n_planes, n_returns : that took part
    roughness : m, standard deviation of the returns about their planes, by the beams as they were
        recorded and as they were found
    """

    offsets: Array
    std: Array
    table: Array
    n_planes: int
    n_returns: int
    roughness: tuple[float, float]

    @property
    def rms(self) -> Array:
        """(4,) how far the beams are off in the mean."""
        return _rms(self.offsets)

    @property
    def matters(self) -> bool:
        """Whether the map is clearly flatter without it."""
        before, after = self.roughness
        return after < WORTH * before

    def sentence(self) -> str:
        """Say what was found."""
        elevation, _, distance, height = self.rms
        blocks = f" and begin {1e3 * height:.0f} mm higher or lower" if height > LEAST[3] else ""
        before, after = (1e3 * value for value in self.roughness)
        return (
            f"the beams of the lidar are {np.degrees(elevation):.2f}° and {1e3 * distance:.0f} mm off in "
            f"the mean{blocks}; surfaces are {after:.0f} mm thick without that, {before:.0f} mm with it"
        )

    def in_payload(self, payload: Payload) -> Payload:
        """Return the head with the beams as they were found, on top of those it has."""
        known, columns = payload.lidar.beams, dict(zip(NAMES, self.offsets.T, strict=True))
        if known is not None:
            for name, values in columns.items():
                columns[name] = values + (getattr(known, name) or 0.0)
        rounded = {n: tuple(np.round(v, DIGITS).tolist()) for n, v in columns.items()}
        table = known.table if known is not None else tuple(np.round(self.table, DIGITS).tolist())
        beams = Beams(**rounded, table=table)
        lidar = payload.lidar.model_copy(update={"beams": beams})
        return payload.model_copy(update={"lidar": lidar})

    @classmethod
    def from_json(cls, described: Mapping[str, Any]) -> FoundBeams:
        """Read what JSON keeps of it."""
        offsets, std, table = (np.array(described[n]) for n in ("offsets", "std", "table"))
        n_planes, n_returns = described["n_planes"], described["n_returns"]
        before, after = described["roughness"]
        return cls(offsets, std, table, n_planes, n_returns, (before, after))
