# SPDX-License-Identifier: MIT OR Apache-2.0
"""Change ROS messages in place: stamps, vectors, ranges and the points of clouds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.recording.messages.point_cloud2 import DATATYPES
from bentwing.recording.point_times import NAMES as TIME_NAMES

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

IMU, ENCODER = "sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState"
SCAN, CLOUD = "sensor_msgs/msg/LaserScan", "sensor_msgs/msg/PointCloud2"
NS_PER_S = 1_000_000_000


def stamp_ns(message: Any) -> int:  # noqa: ANN401 - made at run time
    """Return the header's stamp."""
    stamp = message.header.stamp
    return int(stamp.sec) * NS_PER_S + int(stamp.nanosec)


def set_stamp(message: Any, value: int) -> None:  # noqa: ANN401
    """Write the header's stamp, ns."""
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(value, NS_PER_S)


def gyro(message: Any) -> Array:  # noqa: ANN401
    """Return the angular rates (3,) of an Imu message."""
    return _vector(message.angular_velocity)


def accel(message: Any) -> Array:  # noqa: ANN401
    """Return the specific force (3,) of an Imu message."""
    return _vector(message.linear_acceleration)


def set_gyro(message: Any, value: Array) -> None:  # noqa: ANN401
    """Write the angular rates."""
    _write(message.angular_velocity, value)


def set_accel(message: Any, value: Array) -> None:  # noqa: ANN401
    """Write the specific force."""
    _write(message.linear_acceleration, value)


def _vector(value: Any) -> Array:  # noqa: ANN401
    return np.array([value.x, value.y, value.z])


def _write(vector: Any, value: Array) -> None:  # noqa: ANN401
    vector.x, vector.y, vector.z = value.tolist()


def is_scan(message: Any) -> bool:  # noqa: ANN401
    """Whether it is the scan of a 2D lidar."""
    return bool(message.__msgtype__ == SCAN)


def change_ranges(message: Any, new: Callable[[Array], Array]) -> None:  # noqa: ANN401
    """Replace the ranges, m, of a scan or of a cloud's points along their beams."""
    if is_scan(message):
        message.ranges = new(message.ranges.astype(np.float64)).astype(np.float32)
        return
    points = positions(message)
    ranges = np.linalg.norm(points, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        set_positions(message, points * (new(ranges) / ranges)[:, None])


def positions(message: Any) -> Array:  # noqa: ANN401
    """Return the points (N, 3) of a cloud."""
    rows = table(message)
    return np.column_stack([rows[axis] for axis in "xyz"]).astype(np.float64)


def set_positions(message: Any, points: Array) -> None:  # noqa: ANN401
    """Write the points (N, 3) of a cloud."""
    rows = table(message).copy()
    for axis, values in zip("xyz", points.T, strict=True):
        rows[axis] = values
    set_table(message, rows)


def table(message: Any) -> NDArray[np.void]:  # noqa: ANN401
    """Return the points (N,) of a cloud by the names of its fields."""
    layout = np.dtype(
        {
            "names": [field.name for field in message.fields],
            "formats": [
                (">" if message.is_bigendian else "<") + DATATYPES[field.datatype]
                for field in message.fields
            ],
            "offsets": [field.offset for field in message.fields],
            "itemsize": message.point_step,
        }
    )
    rows: NDArray[np.void] = np.frombuffer(message.data.tobytes(), layout)
    return rows


def set_table(message: Any, rows: NDArray[np.void]) -> None:  # noqa: ANN401
    """Write the points of a cloud."""
    message.data = np.frombuffer(rows.tobytes(), np.uint8)


def time_field(rows: NDArray[np.void]) -> str:
    """Return the name of the field with the points' times."""
    names = rows.dtype.names or ()
    found = next((name for name in names if name.lower() in TIME_NAMES), None)
    if found is None:
        msg = f"this fault needs the time of every point, the clouds have {', '.join(names)}"
        raise UsageError(msg)
    return found
