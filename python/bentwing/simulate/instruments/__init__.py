# SPDX-License-Identifier: MIT OR Apache-2.0
"""What surveyors compare a flight with: a total station and a terrestrial laser scanner."""

from __future__ import annotations

from bentwing.simulate.instruments.terrestrial import (
    Station,
    TerrestrialErrors,
    choose_stations,
    scan,
)
from bentwing.simulate.instruments.total_station import Sighting, TotalStation, track

__all__ = [
    "Sighting",
    "Station",
    "TerrestrialErrors",
    "TotalStation",
    "choose_stations",
    "scan",
    "track",
]
