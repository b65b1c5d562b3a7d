# SPDX-License-Identifier: MIT OR Apache-2.0
"""Beams of a multi-beam lidar that are not where its table says, and their range offsets."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.simulate.beams import Beams
    from bentwing.simulate.ranging import Shots

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BeamErrors:
    """Errors of each beam, by ring.

    Attributes
    ----------
    elevations, azimuths : (R,) rad, true less stated
    offsets : (R,) m, by which its ranges are too long
    rings : (B,) ring of each column of `Beams`
    """

    elevations: Array
    azimuths: Array
    offsets: Array
    rings: NDArray[np.int64] = field(repr=False)

    def actual(self, beams: Beams) -> Beams:
        """Return where the beams truly point to, given where they are said to."""
        x, y, z = np.moveaxis(beams.directions, -1, 0)
        elevation = np.arcsin(z) + self.elevations[self.rings]
        azimuth = np.arctan2(y, x) + self.azimuths[self.rings]
        flat = np.cos(elevation)
        true = [flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)]
        return replace(beams, directions=np.stack(true, axis=-1))

    def apply(self, shots: Shots) -> Shots:
        """Lengthen the ranges by the beams' offsets."""
        return replace(shots, ranges=shots.ranges + self.offsets[self.rings])


def draw_beams(
    rng: np.random.Generator, level: float, rings: Sequence[int], sigma: float
) -> BeamErrors:
    """Draw 8 mm and the lidar's own `sigma` (rad) for each ring, times the level."""
    n = max(rings) + 1
    elevations, azimuths = rng.normal(0.0, sigma * level, (2, n))
    return BeamErrors(elevations, azimuths, rng.normal(0.0, 0.008 * level, n), np.array(rings))
