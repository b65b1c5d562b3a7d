# SPDX-License-Identifier: MIT OR Apache-2.0
"""The messages of lidars by type; another type joins with one line here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bentwing.recording.messages.laser_scan import LaserScans, MultiEchoScans
from bentwing.recording.messages.livox import CUSTOM_MSG, LivoxClouds
from bentwing.recording.messages.point_cloud2 import PointClouds

if TYPE_CHECKING:
    from bentwing.recording.messages.decoder import LidarDecoder

LASER_SCAN = "sensor_msgs/msg/LaserScan"
LIDAR_MESSAGES: dict[str, type[LidarDecoder[Any]]] = {
    LASER_SCAN: LaserScans,
    "sensor_msgs/msg/MultiEchoLaserScan": MultiEchoScans,
    "sensor_msgs/msg/PointCloud2": PointClouds,
    "livox_ros_driver/msg/CustomMsg": LivoxClouds,
    CUSTOM_MSG: LivoxClouds,
}


def is_planar(lidar_type: str) -> bool:
    """Whether messages of a type are scans of one plane."""
    return lidar_type in LIDAR_MESSAGES and LIDAR_MESSAGES[lidar_type].is_planar
