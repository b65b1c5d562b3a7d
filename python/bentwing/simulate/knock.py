# SPDX-License-Identifier: MIT OR Apache-2.0
"""A recording whose IMU was knocked for a while: what an impact does that makes a head stand still."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosbags.rosbag1 import Reader, Writer
from rosbags.typesys import Stores, get_typestore

if TYPE_CHECKING:
    from pathlib import Path

TURN = 0.6
"""rad/s about z that the gyro sees too much."""
PUSH = 2.0
"""m/s² along x that the accelerometer sees too much."""


def knocked(source: Path, target: Path, span: tuple[float, float]) -> None:
    """Write a ROS 1 bag with wrong inertial samples from `span[0]` to `span[1]`, s since its start."""
    store = get_typestore(Stores.ROS1_NOETIC)
    with Reader(source) as reader, Writer(target) as writer:
        new = {
            c.topic: writer.add_connection(c.topic, c.msgtype, typestore=store)
            for c in reader.connections
        }
        for connection, stamp, raw in reader.messages():
            t = 1e-9 * (stamp - reader.start_time)
            if connection.topic == "/imu" and span[0] < t < span[1]:
                message: Any = store.deserialize_ros1(raw, connection.msgtype)
                message.angular_velocity.z += TURN
                message.linear_acceleration.x += PUSH
                raw = bytes(store.serialize_ros1(message, connection.msgtype))
            writer.write(new[connection.topic], stamp, raw)
