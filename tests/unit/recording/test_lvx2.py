# SPDX-License-Identifier: MIT OR Apache-2.0
"""Files of Livox Viewer 2: which points come out of them, with which times, and what is said of others."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest

from bentwing.base.errors import RecordingError
from bentwing.recording.containers.source import open_source
from bentwing.recording.recording import Recording
from support.lvx2 import PACKAGE_NS, PER_PACKAGE, Device, Package, write_lvx2

START_NS = 1_700_000_000 * 10**9
PER_FRAME = 100  # packages


def package(stamp_ns: int, **values) -> Package:
    """Points on a circle of 2 m, each 1 mm higher than the one before."""
    unit = 100 if values.get("kind") == 2 else 1000
    turns = [2 * math.pi * i / PER_PACKAGE for i in range(PER_PACKAGE)]
    points = [
        (round(2 * unit * math.cos(a)), round(2 * unit * math.sin(a)), i, i, 16)
        for i, a in enumerate(turns)
    ]
    return Package(stamp_ns, points, **values)


def frames(n: int, *, start_ns: int = START_NS, **values) -> list[list[Package]]:
    return [
        [package(start_ns + (f * PER_FRAME + i) * PACKAGE_NS, **values) for i in range(PER_FRAME)]
        for f in range(n)
    ]


def read(path):
    with Recording(path) as recording:
        batches = list(recording.batches())
        found = [
            np.concatenate([getattr(b, name) for b in batches]) for name in ("points", "times")
        ]
        return *found, recording


@pytest.mark.parametrize(("kind", "unit"), [(1, 1e-3), (2, 1e-2)])
def test_points_come_in_metres_each_at_its_own_time(tmp_path, kind, unit):
    points, times, recording = read(write_lvx2(tmp_path / "a.lvx2", frames(3, kind=kind)))
    assert len(points) == 3 * PER_FRAME * PER_PACKAGE
    np.testing.assert_allclose(points[1, 2], unit, atol=1e-9)
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1]), 2, atol=unit)
    # 200 000 points a second, one after the other: 5 µs each.
    np.testing.assert_allclose(times, np.arange(len(times)) * 5e-6, atol=2e-9)
    assert recording.start_ns == START_NS
    assert recording.lidar_topic == "livox/47MDK1D0020101"
    assert not recording.warnings


def test_rosbags_reads_the_same_message(tmp_path, ros2):
    source = open_source([write_lvx2(tmp_path / "a.lvx2", frames(1))])
    ((_, _, raw),) = source.messages({"livox/47MDK1D0020101"})
    (topic,) = source.topics
    message = ros2.store.deserialize_cdr(raw, topic.type)
    assert bytes(ros2.store.serialize_cdr(message, topic.type)) == raw
    assert (message.header.stamp.sec, message.timebase) == (START_NS // 10**9, START_NS)
    assert message.point_num == len(message.points) == PER_FRAME * PER_PACKAGE
    last = message.points[-1]
    assert (last.offset_time, last.reflectivity, last.tag) == (9_599 * 5_000, 95, 16)
    assert [point.line for point in message.points[:5]] == [0, 1, 2, 3, 0]


def test_a_lost_package_shifts_no_other_point(tmp_path):
    (whole,) = frames(1)
    path = write_lvx2(tmp_path / "a.lvx2", [[p for i, p in enumerate(whole) if i != 40]])
    _, times, _ = read(path)
    expected = np.delete(np.arange(PER_FRAME * PER_PACKAGE), slice(40 * 96, 41 * 96)) * 5e-6
    np.testing.assert_allclose(times, expected, atol=2e-9)


def test_each_of_two_lidars_is_a_topic(tmp_path):
    devices = Device("first", 1), Device("second", 2, kind=10)
    both = [[package(START_NS + i * PACKAGE_NS, device=d) for i in range(50) for d in devices]]
    source = open_source([write_lvx2(tmp_path / "a.lvx2", both, devices)])
    assert {topic.name: topic.count for topic in source.topics} == {
        "livox/first": 1,
        "livox/second": 1,
    }


def test_packages_of_another_kind_are_counted_and_left_out(tmp_path):
    (whole,) = frames(1)
    spoilt = [Package(START_NS, whole[0].points, kind=7), *whole]
    source = open_source([write_lvx2(tmp_path / "a.lvx2", [spoilt])])
    assert {topic.type: topic.count for topic in source.topics} == {
        "livox/other": 1,
        "livox_ros_driver2/msg/CustomMsg": 1,
    }


def test_a_file_that_was_cut_off_gives_what_is_before(tmp_path):
    path = write_lvx2(tmp_path / "a.lvx2", frames(3))
    path.write_bytes(path.read_bytes()[:-5000])
    points, _, recording = read(path)
    assert len(points) == 2 * PER_FRAME * PER_PACKAGE
    assert any("cut off at byte" in warning for warning in recording.warnings)


def test_a_damaged_frame_ends_the_file(tmp_path):
    path = write_lvx2(tmp_path / "a.lvx2", frames(3))
    raw = bytearray(path.read_bytes())
    (second,) = struct.unpack_from("<q", raw, 24 + 5 + 63 + 8)
    struct.pack_into("<q", raw, second + 8, 2**60)
    path.write_bytes(raw)
    points, _, recording = read(path)
    assert len(points) == PER_FRAME * PER_PACKAGE
    assert any("damaged at byte" in warning for warning in recording.warnings)


@pytest.mark.parametrize(
    ("head", "says"),
    [
        (b"", "begins with nothing"),
        (b"#ROSBAG V2.0\n".ljust(40), "not a file of Livox Viewer 2"),
        (b"livox_tech".ljust(16, b"\0") + bytes([1, 1, 0, 0]) + b"\x67\xa7\x0e\xac", "version 1.1.0.0"),
        (b"livox_tech".ljust(16, b"\0") + bytes([2, 0, 0, 0]) + b"\x67\xa7\x0e\xac", "without a single point"),
    ],
)  # fmt: skip
def test_another_file_is_refused_with_what_it_is(tmp_path, head, says):
    path = tmp_path / "a.lvx2"
    path.write_bytes(head)
    with pytest.raises(RecordingError, match=says):
        open_source([path])
