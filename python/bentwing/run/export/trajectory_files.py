# SPDX-License-Identifier: MIT OR Apache-2.0
"""Trajectories in the formats of other programs."""

from __future__ import annotations

import json
from datetime import datetime, timedelta, timezone
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

import numpy as np

from bentwing.base.atomic import write_text
from bentwing.base.clock import Clock
from bentwing.base.errors import UsageError
from bentwing.run.export.names import TRAJECTORY_FORMATS, TrajectoryFormat

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.map.finished_run import Flight
    from bentwing.run.export.coordinates import Coordinates

SUFFIXES: dict[str, TrajectoryFormat] = {
    ".txt": "tum", ".tum": "tum", ".kitti": "kitti", ".csv": "euroc", ".kml": "kml",
    ".geojson": "geojson",
}  # fmt: skip
_STEP = 0.1  # s between the corners of a path on the Earth
_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
_EUROC = (
    "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []"
)


def write_trajectory(
    path: Path, kind: TrajectoryFormat, flight: Flight, coordinates: Coordinates
) -> None:
    """Write the poses of the IMU; on the Earth for `kml` and `geojson`, else in the frame of the trajectory.

    Raises
    ------
    UsageError
        If nothing says where on the Earth the run is.
    """
    poses, start_ns = flight.trajectory, flight.start_ns
    if kind == "tum":
        poses.write_tum(path, start_ns)
    elif kind == "kitti":
        write_text(path, _kitti(poses))
    elif kind == "euroc":
        write_text(path, _euroc(poses, start_ns))
    else:
        shown = poses[every(poses.times, _STEP)]
        places = coordinates.degrees(shown.positions)
        stamps = [_iso(int(stamp)) for stamp in Clock(start_ns).to_ns(shown.times)]
        write = _kml if kind == "kml" else _geojson
        write_text(path, write(flight.name, places, stamps))


def format_of(path: Path, wanted: str | None) -> TrajectoryFormat | None:
    """Return the format that a file has by its name, or that is wanted; None if it is no trajectory.

    Raises
    ------
    UsageError
        If the wanted one is not known.
    """
    if wanted is None:
        return SUFFIXES.get(path.suffix.lower())
    for known in TRAJECTORY_FORMATS:
        if known == wanted:
            return known
    msg = (
        f"trajectory format {wanted!r} is not known; choose one of {', '.join(TRAJECTORY_FORMATS)}"
    )
    raise UsageError(msg)


def _kitti(poses: Trajectory) -> str:
    """Rows of a pose's first three lines, relative to the first pose as KITTI has them."""
    T = poses.T_map_imu
    relative = np.linalg.inv(T[0]) @ T
    rows = relative[:, :3].reshape(len(T), 12) + 0.0
    return "".join(" ".join(f"{value:.9e}" for value in row) + "\n" for row in rows.tolist())


def _euroc(poses: Trajectory, start_ns: int) -> str:
    stamps = Clock(start_ns).to_ns(poses.times)
    lines = [_EUROC]
    for stamp, (x, y, z), (qx, qy, qz, qw) in zip(
        stamps.tolist(), poses.positions.tolist(), poses.quats_xyzw.tolist(), strict=True
    ):
        lines.append(f"{stamp},{x:.6f},{y:.6f},{z:.6f},{qw:.9f},{qx:.9f},{qy:.9f},{qz:.9f}")
    return "\n".join(lines) + "\n"


def _geojson(name: str, places: NDArray[np.float64], stamps: list[str]) -> str:
    """Return a line as RFC 7946 has it, with a time for each corner as viewers of tracks read it."""
    line = [
        [round(lon, 9), round(lat, 9), round(height, 4)] for lon, lat, height in places.tolist()
    ]
    feature = {
        "type": "Feature",
        "properties": {"name": name, "coordTimes": stamps},
        "geometry": {"type": "LineString", "coordinates": line},
    }
    return json.dumps({"type": "FeatureCollection", "features": [feature]}) + "\n"


def _kml(name: str, places: NDArray[np.float64], stamps: list[str]) -> str:
    """Return a line on the ground: KML counts heights from the sea, and these are of the ellipsoid."""
    line = " ".join(f"{lon:.9f},{lat:.9f},{height:.4f}" for lon, lat, height in places.tolist())
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<kml xmlns="http://www.opengis.net/kml/2.2"><Document>\n'
        f"<Placemark><name>{escape(name)}</name>"
        "<description>Heights are above the WGS 84 ellipsoid.</description>\n"
        f"<TimeSpan><begin>{stamps[0]}</begin><end>{stamps[-1]}</end></TimeSpan>\n"
        "<Style><LineStyle><color>ff0000ff</color><width>3</width></LineStyle></Style>\n"
        "<LineString><tessellate>1</tessellate><altitudeMode>clampToGround</altitudeMode>\n"
        f"<coordinates>{line}</coordinates></LineString></Placemark>\n"
        "</Document></kml>\n"
    )


def every(times: NDArray[np.float64], step: float) -> NDArray[np.bool_]:
    """Return the first pose in each step of time, s, and the last pose."""
    steps = np.floor((times - times[0]) / step + 1e-6)  # stamps in files are rounded
    chosen = np.append(True, np.diff(steps) > 0)
    chosen[-1] = True
    return chosen


def _iso(stamp_ns: int) -> str:
    at = _EPOCH + timedelta(microseconds=stamp_ns // 1000)
    return at.isoformat(timespec="milliseconds").replace("+00:00", "Z")
