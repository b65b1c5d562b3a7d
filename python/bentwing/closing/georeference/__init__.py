# SPDX-License-Identifier: MIT OR Apache-2.0
"""The map on the Earth: from GNSS fixes and control points to projected coordinates."""

from __future__ import annotations

from bentwing.closing.georeference.georeference import Georeferenced, georeference
from bentwing.closing.georeference.settings import GeoreferenceSettings

__all__ = ["GeoreferenceSettings", "Georeferenced", "georeference"]
