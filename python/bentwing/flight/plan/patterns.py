# SPDX-License-Identifier: MIT OR Apache-2.0
"""How each kind of lidar scans: rate of its sweeps, step between beams, what it sees at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording.lidar_kinds import LidarKind


@dataclass(frozen=True, slots=True)
class ScanPattern:
    """Beams of one sweep: azimuth about the lidar's z, elevation from its x-y plane, rad.

    Attributes
    ----------
    rate_hz : sweeps per second
    beam_step : rad, between beams of a line
    azimuth : rad, (from, to), 0 along x
    elevation : rad, (from, to); equal for a lidar with a single scan plane
    n_lines : planes of beams between them
    """

    rate_hz: float
    beam_step: float
    azimuth: tuple[float, float]
    elevation: tuple[float, float]
    n_lines: int

    @property
    def swath(self) -> float:
        """Angle across the lines that one sweep covers, rad; 0 for a single plane."""
        return self.elevation[1] - self.elevation[0]

    @property
    def line_step(self) -> float | None:
        """Angle between neighbouring lines of one sweep, rad; None for a single plane."""
        return self.swath / (self.n_lines - 1) if self.n_lines > 1 else None

    def directions(self, step: float) -> NDArray[np.float64]:
        """Return unit vectors (N, 3), lidar frame, that fill what one sweep covers, `step` rad apart."""
        first, last = self.azimuth
        azimuths = np.linspace(first, last, max(2, int((last - first) / step) + 1))
        low, high = self.elevation
        elevations = np.linspace(low, high, int((high - low) / step) + 1 if high > low else 1)
        a, e = (grid.ravel() for grid in np.meshgrid(azimuths, elevations))
        return np.column_stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


_ALL_AROUND = (-np.pi, np.pi)


def _turning(
    rate_hz: float, step_deg: float, elevation_deg: tuple[float, float], n: int
) -> ScanPattern:
    low, high = np.radians(elevation_deg)
    return ScanPattern(rate_hz, float(np.radians(step_deg)), _ALL_AROUND, (low, high), n)


PATTERNS: dict[LidarKind, ScanPattern] = {
    # the -F of Kaul 2015, section 3.1; the plain UTM-30LX turns at 40 Hz with beams 0.25° apart
    "hokuyo-utm30lx": ScanPattern(
        100.0, float(np.radians(0.65)), (-0.75 * np.pi, 0.75 * np.pi), (0.0, 0.0), 1
    ),
    "vlp16": _turning(10.0, 0.2, (-15.0, 15.0), 16),
    "ouster": _turning(10.0, 360 / 1024, (-22.5, 22.5), 64),
    # Mid-360; its pattern does not repeat, 200,000 points per second are as many as 64 lines here
    "livox": _turning(10.0, 1.15, (-7.0, 52.0), 64),
    "hesai": _turning(10.0, 0.18, (-16.0, 15.0), 32),
    "robosense": _turning(10.0, 0.2, (-25.0, 15.0), 32),
    "generic": _turning(10.0, 0.2, (-15.0, 15.0), 16),
}
