# SPDX-License-Identifier: MIT OR Apache-2.0
"""How a map is put on the Earth."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - pydantic reads the annotations

from pydantic import Field

from bentwing.base.settings import Settings
from bentwing.closing.georeference.names import (
    GeoreferenceMode,  # noqa: TC001 - pydantic reads the annotations
)
from bentwing.recording.gnss_files.names import TimeScale  # noqa: TC001 - pydantic reads it


class GeoreferenceSettings(Settings):
    """How GNSS fixes and control points are used."""

    mode: GeoreferenceMode = Field(
        default="rigid",
        description="`rigid` turns the map about the vertical and shifts it, and leaves its shape alone; "
        "`constraints` also bends the trajectory towards the fixes and control points, as far as it may "
        "have drifted: choose it for long flights with good fixes; `off` ignores them",
    )
    epsg: int | None = Field(
        default=None,
        gt=0,
        le=2**31 - 1,
        description="projected system of the map; default: the UTM zone of the fixes",
    )
    fixes: Path | None = Field(
        default=None,
        description="file of GNSS fixes (RTKLIB .pos, NMEA 0183) instead of those of the recording",
    )
    fixes_time: TimeScale | None = Field(
        default=None,
        description="time scale of that file, `gps` or `utc`; default: what the file says",
    )
    control_points: Path | None = Field(
        default=None, description="CSV file of surveyed control and check points"
    )
