# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a 2D lidar would have seen in place of a level 3D lidar: the ring nearest to level."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.simulate.faults.messages import SCAN, table, time_field

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from rosbags.typesys.store import Typestore

N_BEAMS = 1800
MAX_RANGE = 100.0


def level_scan(cloud: Any, types: Typestore) -> Any:  # noqa: ANN401 - made at run time
    """Return a LaserScan of the ring of a cloud that is nearest to level.

    The beams are evenly spaced in angle and time from the ring's first to its last point; a beam
    without a point has no return.
    """
    ring = _level_ring(table(cloud))
    since = ring[time_field(ring)].astype(np.float64)
    angles = np.unwrap(np.arctan2(ring["y"], ring["x"]).astype(np.float64))
    step, period = (np.ptp(values) / (N_BEAMS - 1) for values in (angles, since))
    step *= np.sign(angles[-1] - angles[0])
    ranges = np.full(N_BEAMS, np.inf, np.float32)
    beams = np.rint((angles - angles[0]) / step).astype(np.int64).clip(0, N_BEAMS - 1)
    ranges[beams] = np.hypot(ring["x"], ring["y"])
    return types.types[SCAN](
        header=cloud.header,
        angle_min=float(angles[0]),
        angle_max=float(angles[0] + step * (N_BEAMS - 1)),
        angle_increment=float(step),
        time_increment=float(period),
        scan_time=float(period * N_BEAMS),
        range_min=0.1,
        range_max=MAX_RANGE,
        ranges=ranges,
        intensities=np.zeros(0, np.float32),
    )


def _level_ring(rows: NDArray[np.void]) -> NDArray[np.void]:
    """Return the points of the ring nearest to the lidar's horizon, in time order."""
    if not {"ring", "x", "y", "z"} <= set(rows.dtype.names or ()):
        msg = f"this fault needs the ring of every point, the clouds have {rows.dtype.names}"
        raise UsageError(msg)
    heights = np.abs(rows["z"]) / np.hypot(rows["x"], rows["y"])
    rings = np.unique(rows["ring"])
    level = min(rings, key=lambda ring: float(np.median(heights[rows["ring"] == ring])))
    chosen = rows[rows["ring"] == level]
    ordered: NDArray[np.void] = chosen[np.argsort(chosen[time_field(chosen)], kind="stable")]
    return ordered
