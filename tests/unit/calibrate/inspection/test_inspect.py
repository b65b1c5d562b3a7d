# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from bentwing.base.errors import RecordingError
from bentwing.calibrate.inspection import inspect
from bentwing.recording import Payload

HEAD = Payload(T_imu_lidar={})


def with_rest(messages, seconds=3.0):
    """Return a head that rests, then spins."""
    entries = []
    rng = np.random.default_rng(0)
    for i in range(round(seconds * 2 * 100)):
        t = i / 100
        angle = 4.0 * max(0.0, t - seconds)
        rate = 4.0 if t > seconds else 0.0
        down = 9.81 * np.array([np.sin(angle), 0.0, np.cos(angle)]) + rng.normal(0, 0.05, 3)
        gyro = rng.normal(0, 0.005, 3) - np.array([0, rate, 0])
        entries.append(("/imu", t, messages.imu(t, gyro, down)))
    times = np.arange(0, seconds * 2, 1 / 40)
    entries += [("/scan", t, messages.scan(t)) for t in times]
    return sorted(entries, key=lambda entry: entry[1])


def level_robot(messages, *, mirrored=False):
    """Return a level 2D lidar in a square room, turned to and fro about the vertical."""
    beams = np.radians(np.arange(360))
    entries = []
    for i in range(60):
        t = i / 10
        yaw = 0.8 * np.sin(t)
        angles = beams + yaw
        ranges = np.minimum(
            np.where(np.cos(angles) > 0, 3.0, 5.0) / np.maximum(np.abs(np.cos(angles)), 1e-6),
            np.where(np.sin(angles) > 0, 2.0, 4.0) / np.maximum(np.abs(np.sin(angles)), 1e-6),
        )
        scan = messages.scan(
            t, ranges, angle_min=0.0, angle_increment=np.radians(1), time_increment=1e-6
        )
        entries.append(("/scan", t, scan))
    for i in range(600):
        t = i / 100
        rate = 0.8 * np.cos(t) * (-1 if mirrored else 1)
        entries.append(("/imu", t, messages.imu(t, (0, 0, rate))))
    return sorted(entries, key=lambda entry: entry[1])


def test_a_good_recording_is_fit(tmp_path, ros1):
    found = inspect(ros1.write(tmp_path / "a.bag", with_rest(ros1)), HEAD)
    assert found.is_fit
    assert found.defects == []
    assert found.warnings == []
    assert found.static_start == pytest.approx((0.0, 2.7), abs=0.1)
    assert found.spin.usual == pytest.approx(4.0, abs=0.1)
    assert found.structure.valid_share == 1.0
    assert found.structure.range_percentiles == pytest.approx([5.05] * 5)
    by_role = {topic.role: topic for topic in found.topics}
    assert by_role["imu"].rate_hz == pytest.approx(100, rel=0.01)
    assert by_role["lidar"].rate_hz == pytest.approx(40, rel=0.01)


def test_a_start_in_motion_is_a_warning_not_a_defect(tmp_path, ros1, head_entries):
    found = inspect(ros1.write(tmp_path / "a.bag", head_entries(ros1)), HEAD)
    assert found.is_fit
    assert found.static_start is None
    assert any("no static start" in text for text in found.warnings)


@pytest.mark.parametrize(
    ("every", "found"), [(10_000, "1 message only"), (40, "2.5 Hz")], ids=["one", "slow"]
)
def test_an_imu_that_says_next_to_nothing_is_a_defect(tmp_path, ros1, every, found):
    entries = with_rest(ros1)
    imu = [entry for entry in entries if entry[0] == "/imu"]
    rest = [entry for entry in entries if entry[0] != "/imu"]
    recording = ros1.write(tmp_path / "few.bag", [*imu[::every], *rest])
    defects = inspect([recording]).defects
    assert any(f"/imu: {found}" in defect for defect in defects)


def test_a_level_2d_lidar_cannot_make_a_3d_map(tmp_path, ros1):
    found = inspect(ros1.write(tmp_path / "a.bag", level_robot(ros1)), HEAD)
    (defect,) = found.defects
    assert "cannot make a 3D map" in defect


def test_a_gyro_that_turns_against_the_scans_is_found(tmp_path, ros1):
    found = inspect(ros1.write(tmp_path / "a.bag", level_robot(ros1, mirrored=True)), HEAD)
    assert any("one axis is mirrored" in text for text in found.defects)


def test_a_2d_lidar_alone_is_not_enough(tmp_path, ros1):
    entries = [("/scan", i / 40, ros1.scan(i / 40)) for i in range(40)]
    found = inspect(ros1.write(tmp_path / "a.bag", entries))
    assert any("without IMU and encoder" in text for text in found.defects)


def test_a_lidar_that_saw_nothing_is_a_defect(tmp_path, ros1):
    entries = [("/scan", i / 40, ros1.scan(i / 40, np.full(100, np.inf))) for i in range(40)]
    found = inspect(ros1.write(tmp_path / "a.bag", entries))
    assert any("no valid return at all" in text for text in found.defects)


def test_a_recording_without_lidar_still_lists_its_topics(tmp_path, ros1):
    found = inspect(ros1.write(tmp_path / "a.bag", [("/imu", 0.0, ros1.imu(0.0))]))
    assert [topic.name for topic in found.topics] == ["/imu"]
    assert "no lidar topic" in found.defects[0]


def test_a_file_that_is_no_recording_is_an_error(tmp_path):
    path = tmp_path / "a.bag"
    path.write_bytes(b"no")
    with pytest.raises(RecordingError):
        inspect(path)


def test_no_mount_is_made_up_where_all_looks_alike(tmp_path, ros1):
    # The same range everywhere and always.
    found = inspect(ros1.write(tmp_path / "a.bag", with_rest(ros1)), Payload(imu={}))
    assert not found.set_up.findings
    assert "fits together in any mount" in found.set_up.doubt
