# SPDX-License-Identifier: MIT OR Apache-2.0
"""rosbags' own deserialization is the oracle for the views on the bytes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from bentwing.recording.messages import livox, wire, wire_clouds, wire_scans
from bentwing.recording.messages.lidar_messages import LIDAR_MESSAGES

STAMP_NS = 1_700_000_000_250_000_000
FRAMES = ["", "a", "ab", "abc", "laser", "base_link/front"]


@pytest.mark.parametrize("frame", FRAMES)
def test_scan_is_read_whatever_the_alignment_after_the_frame_id(ros, frame):
    message = ros.scan(0.25, [1.0, 2.0, 3.0], frame=frame, intensities=np.array([4, 5, 6], "f4"))
    scan = wire_scans.laser_scan(ros.serialize(message), cdr=not ros.ros1)
    assert scan.stamp_ns == STAMP_NS
    assert scan.range_max == message.range_max
    assert scan.time_increment == pytest.approx(message.time_increment)
    np.testing.assert_array_equal(scan.ranges, message.ranges)
    np.testing.assert_array_equal(scan.intensities, message.intensities)


@pytest.mark.parametrize("frame", FRAMES)
def test_imu_is_read_whatever_the_alignment_after_the_frame_id(ros, frame):
    raw = ros.serialize(ros.imu(0.25, (1, 2, 3), (4, 5, 6), frame=frame))
    stamp_ns, body = wire.imu(raw, cdr=not ros.ros1)
    values = np.frombuffer(body, "<f8")
    assert stamp_ns == STAMP_NS
    np.testing.assert_array_equal(values[13:16], [1, 2, 3])
    np.testing.assert_array_equal(values[25:28], [4, 5, 6])


@pytest.mark.parametrize("names", [(), ("m",), ("motor",), ("motor", "zweites Gelenk, é")])
def test_joints_are_read_with_names_of_any_length(ros, names):
    raw = ros.serialize(ros.joint(0.25, (1.5, -2.5), names=names))
    stamp_ns, joints = wire.joints(raw, cdr=not ros.ros1)
    assert (stamp_ns, joints) == (STAMP_NS, (names, (1.5, -2.5)))


def test_a_joint_is_found_by_its_name(ros):
    raw = ros.serialize(ros.joint(0.25, (1.5, -2.5), names=("pan", "tilt", "without position")))
    _, joints = wire.joints(raw, cdr=not ros.ros1)
    found = [joints.position(name) for name in (None, "pan", "tilt", "without position", "roll")]
    assert found == [1.5, 1.5, -2.5, None, None]


def test_joint_state_without_position_is_broken(ros):
    message = ros.joint(0.25, 1.5)
    message.position = np.zeros(0)
    with pytest.raises(wire.BrokenMessageError, match="no position"):
        wire.joints(ros.serialize(message), cdr=not ros.ros1)


@pytest.mark.parametrize("frame", FRAMES)
def test_cloud_is_read_with_all_its_fields(ros, frame):
    table = np.zeros(3, [("x", "f4"), ("intensity", "u1"), ("timestamp", "f8")])
    table["x"] = [1, 2, 3]
    cloud = wire_clouds.point_cloud(
        ros.serialize(ros.cloud(0.25, table, frame=frame)), cdr=not ros.ros1
    )
    assert (cloud.stamp_ns, cloud.height, cloud.width) == (STAMP_NS, 1, 3)
    assert [field.name for field in cloud.fields] == ["x", "intensity", "timestamp"]
    assert [field.offset for field in cloud.fields] == [0, 4, 5]
    assert bytes(cloud.data) == table.tobytes()


def test_multi_echo_keeps_the_first_echo_within_range(ros):
    message = ros.multi_echo(0.25, [[0.01, 2.0, 3.0], [4.0], []], [[1, 2, 3], [4], []])
    scan = wire_scans.multi_echo_scan(ros.serialize(message), cdr=not ros.ros1)
    np.testing.assert_array_equal(scan.ranges, [2.0, 4.0, np.nan])
    np.testing.assert_array_equal(scan.intensities, [2, 4, 0])


def test_livox_points_are_read_with_their_offsets(ros):
    points = [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    raw = ros.serialize(ros.livox(0.25, [0, 1000, 2000], points))
    message = livox.livox_custom(raw, cdr=not ros.ros1)
    assert message.stamp_ns == STAMP_NS
    np.testing.assert_array_equal(message.points["offset_time"], [0, 1000, 2000])
    np.testing.assert_array_equal(message.points["y"], [2, 5, 8])
    np.testing.assert_array_equal(message.points["line"], [0, 1, 2])


def test_big_endian_cdr_is_read(ros2):
    message = ros2.scan(0.25, [1.0, 2.0])
    raw = bytes(ros2.store.serialize_cdr(message, message.__msgtype__, little_endian=False))
    scan = wire_scans.laser_scan(raw, cdr=True)
    assert scan.stamp_ns == STAMP_NS
    np.testing.assert_array_equal(scan.ranges, [1.0, 2.0])


def test_every_truncation_is_a_broken_message(ros):
    table = np.zeros(2, [("x", "f4"), ("y", "f4"), ("z", "f4")])
    cdr = not ros.ros1
    whole = [
        (wire.imu, ros.serialize(ros.imu(0.25))),
        (wire_scans.laser_scan, ros.serialize(ros.scan(0.25, [1, 2]))),
        (wire_scans.multi_echo_scan, ros.serialize(ros.multi_echo(0.25, [[1.0]], [[1.0]]))),
        (wire_clouds.point_cloud, ros.serialize(ros.cloud(0.25, table))),
    ]
    for parse, raw in whole:
        # The last value of a cloud, is_dense, is not read.
        for n in range(len(raw) - 1):
            with pytest.raises(wire.BrokenMessageError):
                parse(raw[:n], cdr=cdr)


@pytest.mark.parametrize("kind", LIDAR_MESSAGES)
def test_the_documentation_names_every_type_that_is_read(kind):
    package, name = kind.split("/msg/")
    text = (Path(__file__).parents[3] / "docs" / "sensors.md").read_text(encoding="utf-8")
    row = rf"^\| `({package}/{name}`|{name}` of .*`{package}`)"
    assert re.search(row, text, re.MULTILINE)
