# SPDX-License-Identifier: MIT OR Apache-2.0
"""Records as ROS messages in a bag, through the `rosbags` library."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from bentwing.simulate.records import (
    CloudRecord,
    EncoderRecord,
    FixRecord,
    ImuRecord,
    Record,
    ScanRecord,
)

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType

    from typing_extensions import Self

EPOCH_NS = 1_704_067_200_000_000_000
"""The recordings begin on 1 January 2024, 00:00 UTC."""


DATATYPES = {"<f4": 7, "<u4": 6, "<u2": 4}
"""Of `sensor_msgs/PointField`, by the format of a field."""

Message = Any
"""A message or its class, made by `rosbags` at run time from ROS's own definitions."""


def to_ns(time: float) -> int:
    """Absolute nanoseconds of a time since the recording's start."""
    return EPOCH_NS + round(time * 1e9)


class BagWriter:
    """Writes records, in the order they come, to a ROS 1 bag or a ROS 2 folder (mcap or db3)."""

    def __init__(self, path: Path, kind: str) -> None:
        self._is_ros1 = kind == "bag"
        store = Stores.ROS1_NOETIC if self._is_ros1 else Stores.ROS2_HUMBLE
        self._types = get_typestore(store)
        self._writer: Any
        if self._is_ros1:
            self._writer = Ros1Writer(path)
        else:
            plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
            self._writer = Ros2Writer(path, version=9, storage_plugin=plugin)
        self._connections: dict[str, Any] = {}
        self._counts: dict[str, int] = {}

    def __enter__(self) -> Self:
        self._writer.open()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._writer.close()

    def write(self, topic: str, frame: str, record: Record) -> None:
        """Append one record, at its time of arrival."""
        message = self._message(record, self._header(topic, frame, record.stamp))
        kind: str = message.__msgtype__
        if topic not in self._connections:
            connection = self._writer.add_connection(topic, kind, typestore=self._types)
            self._connections[topic] = connection
        encode = self._types.serialize_ros1 if self._is_ros1 else self._types.serialize_cdr
        data = encode(message, kind)
        self._writer.write(self._connections[topic], to_ns(record.arrival), data)

    def _type(self, name: str) -> Message:
        return self._types.types[name]

    def _header(self, topic: str, frame: str, stamp: float) -> Message:
        sec, nanosec = divmod(to_ns(stamp), 1_000_000_000)
        time = self._type("builtin_interfaces/msg/Time")(sec, nanosec)
        count = self._counts.get(topic, 0)
        self._counts[topic] = count + 1
        header = self._type("std_msgs/msg/Header")
        return header(count, time, frame) if self._is_ros1 else header(time, frame)

    def _message(self, record: Record, header: Message) -> Message:
        match record:
            case ScanRecord():
                return self._scan(record, header)
            case CloudRecord():
                return self._cloud(record, header)
            case ImuRecord():
                return self._imu(record, header)
            case EncoderRecord():
                return self._encoder(record, header)
            case FixRecord():
                return self._fix(record, header)

    def _scan(self, record: ScanRecord, header: Message) -> Message:
        span = record.angle_increment * (len(record.ranges) - 1)
        return self._type("sensor_msgs/msg/LaserScan")(
            header=header,
            angle_min=record.angle_min,
            angle_max=record.angle_min + span,
            angle_increment=record.angle_increment,
            time_increment=record.time_increment,
            scan_time=record.scan_time,
            range_min=record.range_min,
            range_max=record.range_max,
            ranges=record.ranges,
            intensities=record.intensities,
        )

    def _cloud(self, record: CloudRecord, header: Message) -> Message:
        field = self._type("sensor_msgs/msg/PointField")
        kinds = record.points.dtype
        fields = [
            field(name, details[1], DATATYPES[details[0].str], 1)
            for name, details in (kinds.fields or {}).items()
        ]
        height, width = record.points.shape if record.points.ndim == 2 else (1, record.points.size)
        data = np.frombuffer(record.points.tobytes(), dtype=np.uint8)
        return self._type("sensor_msgs/msg/PointCloud2")(
            header=header,
            height=height,
            width=width,
            fields=fields,
            is_bigendian=False,
            point_step=kinds.itemsize,
            row_step=kinds.itemsize * width,
            data=data,
            is_dense=True,
        )

    def _imu(self, record: ImuRecord, header: Message) -> Message:
        vector = self._type("geometry_msgs/msg/Vector3")
        unknown = np.zeros(9)
        # -1 says that there is no orientation (sensor_msgs/Imu).
        no_orientation = np.array([-1.0, *[0.0] * 8])
        return self._type("sensor_msgs/msg/Imu")(
            header=header,
            orientation=self._type("geometry_msgs/msg/Quaternion")(0.0, 0.0, 0.0, 1.0),
            orientation_covariance=no_orientation,
            angular_velocity=vector(*record.gyro),
            angular_velocity_covariance=unknown,
            linear_acceleration=vector(*record.accel),
            linear_acceleration_covariance=unknown,
        )

    def _fix(self, record: FixRecord, header: Message) -> Message:
        status = self._type("sensor_msgs/msg/NavSatStatus")(status=0, service=1)
        return self._type("sensor_msgs/msg/NavSatFix")(
            header=header,
            status=status,
            latitude=record.latitude,
            longitude=record.longitude,
            altitude=record.height,
            position_covariance=record.covariance,
            position_covariance_type=2,
        )

    def _encoder(self, record: EncoderRecord, header: Message) -> Message:
        return self._type("sensor_msgs/msg/JointState")(
            header=header,
            name=["motor"],
            position=np.array([record.angle]),
            velocity=np.array([]),
            effort=np.array([]),
        )
