# SPDX-License-Identifier: MIT OR Apache-2.0
"""Find the topics of lidar, IMU and encoder: by the payload's name, else by type."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from bentwing.errors import RecordingError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.recording.payload import Payload
    from bentwing.recording.scanned import TopicInfo

LASER_SCAN = "sensor_msgs/msg/LaserScan"
MULTI_ECHO = "sensor_msgs/msg/MultiEchoLaserScan"
POINT_CLOUD = "sensor_msgs/msg/PointCloud2"
LIVOX = ("livox_ros_driver/msg/CustomMsg", "livox_ros_driver2/msg/CustomMsg")
LIDAR_TYPES = (LASER_SCAN, MULTI_ECHO, POINT_CLOUD, *LIVOX)
IMU_TYPES = ("sensor_msgs/msg/Imu",)
ENCODER_TYPES = ("sensor_msgs/msg/JointState",)


class Roles(NamedTuple):
    """Which topic plays which part; None where the recording has none."""

    lidar: TopicInfo
    imu: TopicInfo | None
    encoder: TopicInfo | None


def resolve(topics: Sequence[TopicInfo], payload: Payload) -> Roles:
    """Return the topics to read.

    Raises
    ------
    RecordingError
        A topic is missing, has the wrong type, or cannot be told from others.
    """
    lidar = _one(topics, "lidar", LIDAR_TYPES, payload.lidar.topic)
    if lidar is None:
        msg = (
            f"no lidar topic: expected one of the types {', '.join(LIDAR_TYPES)}, "
            f"the recording has {_listed(topics)}"
        )
        raise RecordingError(msg)
    encoder = None
    if payload.encoder is not None:
        encoder = _one(topics, "encoder", ENCODER_TYPES, payload.encoder.topic)
        if encoder is None:
            msg = (
                "the payload describes an encoder, but the recording has no topic of type "
                f"{ENCODER_TYPES[0]} (it has {_listed(topics)}); record the encoder, or remove "
                "'encoder' from the payload if the lidar does not turn"
            )
            raise RecordingError(msg)
    return Roles(lidar, _imu(topics, payload), encoder)


def _imu(topics: Sequence[TopicInfo], payload: Payload) -> TopicInfo | None:
    if payload.imu is None:
        return None
    imu = _one(topics, "imu", IMU_TYPES, payload.imu.topic)
    if imu is None and payload.describes_imu:
        msg = (
            f"the payload describes an IMU, but the recording has no topic of type {IMU_TYPES[0]} "
            f"(it has {_listed(topics)}); record the IMU, or write 'imu: null' and remove "
            "T_imu_lidar to map with the lidar alone"
        )
        raise RecordingError(msg)
    return imu


def _one(
    topics: Sequence[TopicInfo], role: str, types: Sequence[str], name: str | None
) -> TopicInfo | None:
    """Return the topic named, or the only one of the right type that has messages."""
    if name is not None:
        return _named(topics, role, types, name)
    candidates = [topic for topic in topics if topic.type in types]
    filled = [topic for topic in candidates if topic.count] or candidates
    if len(filled) > 1:
        msg = (
            f"{len(filled)} topics could be the {role}: {_listed(filled)}; "
            f"name one in the payload under '{role}: {{topic: ...}}'"
        )
        raise RecordingError(msg)
    return _filled(filled[0], role) if filled else None


def _named(topics: Sequence[TopicInfo], role: str, types: Sequence[str], name: str) -> TopicInfo:
    # ROS 1 drivers publish both spellings of the same name.
    found = next((topic for topic in topics if topic.name.strip("/") == name.strip("/")), None)
    if found is None:
        msg = (
            f"the payload names the {role} topic {name}, which the recording does not have "
            f"(it has {_listed(topics)}); correct '{role}: {{topic: ...}}' in the payload"
        )
        raise RecordingError(msg)
    if found.type not in types:
        msg = (
            f"topic {found.name} has the type {found.type or 'unknown'}, which cannot be read as "
            f"{role}; supported are {', '.join(types)}"
        )
        raise RecordingError(msg)
    return _filled(found, role)


def _filled(topic: TopicInfo, role: str) -> TopicInfo:
    if topic.count == 0:
        msg = (
            f"topic {topic.name} ({role}) has no messages; check that the driver ran while "
            "recording, or name another topic in the payload"
        )
        raise RecordingError(msg)
    return topic


def _listed(topics: Sequence[TopicInfo]) -> str:
    return ", ".join(f"{topic.name} [{topic.type}]" for topic in topics) or "no topics"
