# SPDX-License-Identifier: MIT OR Apache-2.0
"""The points of a map before they were moved along their beams: by these a trajectory is judged."""

from __future__ import annotations

from typing import TYPE_CHECKING

import laspy
import numpy as np

from bentwing.base import geometry
from bentwing.base.calibration import Calibration
from bentwing.base.gps_time import adjusted_gps_origin
from bentwing.base.mount import FixedMount
from bentwing.base.run_record import read_record
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.map.measured import moved_back

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def measured_points(path: Path, origin_ns: int) -> tuple[Array, Array]:
    """Read the points (N, 3), m, of the LAZ map of a run as they were measured, and their times (N,).

    Parameters
    ----------
    origin_ns : epoch of the times, s
    """
    table = laspy.read(path)
    points = np.asarray(table.xyz)
    times = np.asarray(table.gps_time) - adjusted_gps_origin(origin_ns)
    if "shift" not in table.point_format.dimension_names:
        return points, times
    found, _ = read_tum(path.parent / "trajectory.txt", origin_ns)
    lidar = path_of_lidar(found, Calibration.from_json(read_record(path.parent)["calibration"]))
    # GPS times are rounded to less than a microsecond.
    places, _ = lidar.interpolate(np.clip(times, lidar.times[0], lidar.times[-1]))
    return moved_back(points, places, np.asarray(table["shift"], np.float64)), times


def path_of_lidar(trajectory: Trajectory, calibration: Calibration) -> Trajectory:
    """Return the path of the lidar; of a turned one that of its place at the encoder's zero."""
    mount = calibration.mount
    pose = mount.T_imu_lidar if isinstance(mount, FixedMount) else mount.lidar_at(0.0)
    places = geometry.compose(
        trajectory.positions, trajectory.quats_xyzw, np.tile(pose.translation, (len(trajectory), 1))
    )
    return Trajectory(trajectory.times, places, trajectory.quats_xyzw)
