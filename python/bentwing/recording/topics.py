# SPDX-License-Identifier: MIT OR Apache-2.0
"""Find the topics of lidar, IMU and encoder: by the payload's name, else by type."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from bentwing.base.errors import RecordingError
from bentwing.recording.messages.lidar_messages import LIDAR_MESSAGES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.recording.containers.scanned import TopicInfo
    from bentwing.recording.payload import Payload

IMU = "sensor_msgs/msg/Imu"
VELODYNE_SCAN = "velodyne_msgs/msg/VelodyneScan"
# Both of the lidar's packets and of those of its IMU; the topic's name tells which.
OUSTER_PACKETS = (
    "ouster_ros/msg/PacketMsg",
    "ouster_sensor_msgs/msg/PacketMsg",
    "ouster_msgs/msg/PacketMsg",
)
# Datagrams in a pcap.
UDP_VELODYNE, UDP_OUSTER_LIDAR = "udp/velodyne", "udp/ouster_lidar"
UDP_OUSTER_IMU = "udp/ouster_imu"
# Of Hesai's drivers, old and new, and of RoboSense's.
HESAI_SCANS = ("hesai_lidar/msg/PandarScan", "hesai_ros_driver/msg/UdpFrame")
RSLIDAR_PACKET = "rslidar_msg/msg/RslidarPacket"
UDP_HESAI, UDP_ROBOSENSE = "udp/hesai", "udp/robosense"
UDP_ROBOSENSE_DEVICE = "udp/robosense_device"  # the angles of its beams, among others
STRING = "std_msgs/msg/String"
VELODYNE_TYPES = (VELODYNE_SCAN, UDP_VELODYNE)
OUSTER_TYPES = (*OUSTER_PACKETS, UDP_OUSTER_LIDAR, UDP_OUSTER_IMU)
HESAI_TYPES = (*HESAI_SCANS, UDP_HESAI)
ROBOSENSE_TYPES = (RSLIDAR_PACKET, UDP_ROBOSENSE)
PACKET_TYPES = (*VELODYNE_TYPES, *OUSTER_TYPES, *HESAI_TYPES, *ROBOSENSE_TYPES)
# By preference: where a driver recorded both, its decoded messages need nothing else.
LIDAR_TYPES = (
    tuple(LIDAR_MESSAGES),
    (*VELODYNE_TYPES, *OUSTER_PACKETS, UDP_OUSTER_LIDAR, *HESAI_TYPES, *ROBOSENSE_TYPES),
)
IMU_TYPES = ((IMU,), (*OUSTER_PACKETS, UDP_OUSTER_IMU))
NAV_SAT_FIX = "sensor_msgs/msg/NavSatFix"
JOINT_STATE = "sensor_msgs/msg/JointState"
ENCODER_TYPES = ((JOINT_STATE,),)
TF_TYPES = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
STATIC = "tf_static"  # how the names of topics end that hold what never changes


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
            f"no lidar topic: expected one of the types {_joined(LIDAR_TYPES)}, "
            f"the recording has {_listed(topics)}"
        )
        raise RecordingError(msg)
    encoder = None
    if payload.encoder is not None:
        is_tf = payload.encoder.from_tf is not None
        types = (TF_TYPES,) if is_tf else ENCODER_TYPES
        possible = [topic for topic in topics if not (is_tf and topic.name.endswith(STATIC))]
        encoder = _one(possible, "encoder", types, payload.encoder.topic)
        if encoder is None:
            msg = (
                "the payload describes an encoder, but the recording has no topic of type "
                f"{types[0][0]} (it has {_listed(topics)}); record the encoder, or remove "
                "'encoder' from the payload if the lidar does not turn"
            )
            raise RecordingError(msg)
    return Roles(lidar, _imu(topics, payload, lidar), encoder)


def _imu(topics: Sequence[TopicInfo], payload: Payload, lidar: TopicInfo) -> TopicInfo | None:
    if payload.imu is None:
        return None
    # The IMU in the lidar is not used unasked where the lidar itself does not need its decoder.
    is_asked = payload.imu.topic is not None or lidar.type in OUSTER_TYPES
    imu = _one(topics, "imu", IMU_TYPES if is_asked else IMU_TYPES[:1], payload.imu.topic)
    if imu is None and payload.describes_imu:
        msg = (
            f"the payload describes an IMU, but the recording has no topic of type {IMU} "
            f"(it has {_listed(topics)}); record the IMU, or write 'imu: null' and remove "
            "T_imu_lidar to map with the lidar alone"
        )
        raise RecordingError(msg)
    return imu


def _one(
    topics: Sequence[TopicInfo], role: str, types: Sequence[Sequence[str]], name: str | None
) -> TopicInfo | None:
    """Return the topic named, or the only one of the preferred types that has messages."""
    if name is not None:
        return _named(topics, role, types, name)
    found = candidates(topics, role, types)
    if len(found) > 1:
        msg = (
            f"{len(found)} topics could be the {role}: {_listed(found)}; "
            f"name one in the payload under '{role}: {{topic: ...}}'"
        )
        raise RecordingError(msg)
    return _filled(found[0], role) if found else None


def candidates(
    topics: Sequence[TopicInfo], role: str, types: Sequence[Sequence[str]]
) -> list[TopicInfo]:
    """Return the topics that could play a part: those of the preferred types that have messages."""
    groups = [[topic for topic in topics if _plays(topic, role, group)] for group in types]
    filled = [found for group in groups if (found := [topic for topic in group if topic.count])]
    return next(iter([*filled, *filter(None, groups)]), [])


def _plays(topic: TopicInfo, role: str, types: Sequence[str]) -> bool:
    is_other_half = topic.type in OUSTER_PACKETS and role not in topic.name.rpartition("/")[2]
    return topic.type in types and not is_other_half


def _named(
    topics: Sequence[TopicInfo], role: str, types: Sequence[Sequence[str]], name: str
) -> TopicInfo:
    # ROS 1 drivers publish both spellings of the same name.
    found = next((topic for topic in topics if topic.name.strip("/") == name.strip("/")), None)
    if found is None:
        msg = (
            f"the payload names the {role} topic {name}, which the recording does not have "
            f"(it has {_listed(topics)}); correct '{role}: {{topic: ...}}' in the payload"
        )
        raise RecordingError(msg)
    if not any(found.type in group for group in types):
        msg = (
            f"topic {found.name} has the type {found.type or 'unknown'}, which cannot be read as "
            f"{role}; supported are {_joined(types)}"
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


def _joined(types: Sequence[Sequence[str]]) -> str:
    return ", ".join(kind for group in types for kind in group)


def _listed(topics: Sequence[TopicInfo]) -> str:
    return ", ".join(f"{topic.name} [{topic.type}]" for topic in topics) or "no topics"
