# SPDX-License-Identifier: MIT OR Apache-2.0
"""The names of trajectory formats, apart from their writers so that a help page shows them at once."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

TrajectoryFormat: TypeAlias = Literal["tum", "kitti", "euroc", "kml", "geojson"]
TRAJECTORY_FORMATS: tuple[TrajectoryFormat, ...] = get_args(TrajectoryFormat)
