# SPDX-License-Identifier: MIT OR Apache-2.0
"""Another participant of DDS, as a driver and a listener of ROS 2 would be, in a process of its own.

It plays a ROS 1 bag with a cloud and an IMU at its own speed, and prints what it hears as JSON. Its types are
written down here, apart from those that bentwing makes.
"""

import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from rosbags.highlevel import AnyReader


@dataclass
class Time_(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header_(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time_
    frame_id: str


@dataclass
class Vector3_(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Point_(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion_(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Imu_(IdlStruct, typename="sensor_msgs::msg::dds_::Imu_"):
    header: Header_
    orientation: Quaternion_
    orientation_covariance: array[float64, 9]
    angular_velocity: Vector3_
    angular_velocity_covariance: array[float64, 9]
    linear_acceleration: Vector3_
    linear_acceleration_covariance: array[float64, 9]


@dataclass
class PointField_(IdlStruct, typename="sensor_msgs::msg::dds_::PointField_"):
    name: str
    offset: uint32
    datatype: uint8
    count: uint32


@dataclass
class PointCloud2_(IdlStruct, typename="sensor_msgs::msg::dds_::PointCloud2_"):
    header: Header_
    height: uint32
    width: uint32
    fields: sequence[PointField_]
    is_bigendian: bool
    point_step: uint32
    row_step: uint32
    data: sequence[uint8]
    is_dense: bool


@dataclass
class Pose_(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point_
    orientation: Quaternion_


@dataclass
class PoseWithCovariance_(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovariance_"):
    pose: Pose_
    covariance: array[float64, 36]


@dataclass
class Twist_(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Vector3_
    angular: Vector3_


@dataclass
class TwistWithCovariance_(IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovariance_"):
    twist: Twist_
    covariance: array[float64, 36]


@dataclass
class Odometry_(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    header: Header_
    child_frame_id: str
    pose: PoseWithCovariance_
    twist: TwistWithCovariance_


@dataclass
class Transform_(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3_
    rotation: Quaternion_


@dataclass
class TransformStamped_(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header_
    child_frame_id: str
    transform: Transform_


@dataclass
class TFMessage_(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped_]


@dataclass
class PoseStamped_(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    header: Header_
    pose: Pose_


@dataclass
class Path_(IdlStruct, typename="nav_msgs::msg::dds_::Path_"):
    header: Header_
    poses: sequence[PoseStamped_]


@dataclass
class KeyValue_(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus_(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue_]


@dataclass
class DiagnosticArray_(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header_
    status: sequence[DiagnosticStatus_]


def copied(kind, message):
    """A message of rosbags as one of the types above."""
    values = []
    for name, field in kind.__annotations__.items():
        value = getattr(message, name)
        if isinstance(value, list):
            value = [copied(PointField_, one) for one in value]
        elif hasattr(value, "tobytes"):
            value = value.tobytes() if value.dtype == "u1" else value.tolist()
        elif hasattr(value, "__msgtype__"):
            value = copied(field, value)
        values.append(value)
    return kind(*values)


def main(bag: str, domain: int, lidar: str, imu: str) -> None:
    """Play a bag, and print what was heard."""
    participant = DomainParticipant(domain)
    best_effort = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(10))
    reliable = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(500))
    writers = {
        lidar: (PointCloud2_, DataWriter(participant, Topic(participant, f"rt{lidar}", PointCloud2_), best_effort)),
        imu: (Imu_, DataWriter(participant, Topic(participant, f"rt{imu}", Imu_), reliable)),
    }  # fmt: skip
    heard = {
        name: DataReader(participant, Topic(participant, f"rt{name}", kind), reliable)
        for name, kind in (
            ("/bentwing/odometry", Odometry_), ("/tf", TFMessage_), ("/bentwing/path", Path_),
            ("/bentwing/map_points", PointCloud2_), ("/diagnostics", DiagnosticArray_),
        )
    }  # fmt: skip
    print("ready", flush=True)
    sys.stdin.readline()
    odometry, links, paths, maps, statuses = [], [], [], [], []

    def taken(name):
        # A writer that leaves is told by samples without content.
        return [one for one in heard[name].take(500) if isinstance(one, IdlStruct)]

    def hear() -> None:
        for one in taken("/bentwing/odometry"):
            place, turn = one.pose.pose.position, one.pose.pose.orientation
            pose = [place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w]
            stamp = one.header.stamp.sec * 10**9 + one.header.stamp.nanosec
            odometry.append(
                [stamp, one.header.frame_id, one.child_frame_id, pose, list(one.pose.covariance)]
            )
        links.extend(
            [t.header.frame_id, t.child_frame_id] for one in taken("/tf") for t in one.transforms
        )
        paths.extend(len(one.poses) for one in taken("/bentwing/path"))
        maps.extend(one.width for one in taken("/bentwing/map_points"))
        statuses.extend(one.status[0].message for one in taken("/diagnostics"))

    with AnyReader([Path(bag)]) as reader:
        begin = None
        for connection, stamp_ns, raw in reader.messages():
            if connection.topic not in writers:
                continue
            begin = begin or (stamp_ns, time.monotonic())
            due = begin[1] + (stamp_ns - begin[0]) * 1e-9
            time.sleep(max(0.0, due - time.monotonic()))
            kind, writer = writers[connection.topic]
            writer.write(copied(kind, reader.deserialize(raw, connection.msgtype)))
            hear()
    time.sleep(1.0)
    hear()
    found = {"odometry": odometry, "tf": links, "paths": paths, "maps": maps, "statuses": statuses}
    print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), sys.argv[3], sys.argv[4])
