# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recordings as a user opens them: what comes out, and what is said of those that are no good."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from bentwing.base.errors import PayloadError, RecordingError
from bentwing.recording import LidarBatch, Payload, Recording
from support.recordings import HEAD, NO_IMU, joined, read

START_NS = 1_700_000_000 * 10**9


@pytest.mark.parametrize("kind", ["bag", "mcap", "db3"])
def test_a_head_comes_out_whole_in_every_container(tmp_path, ros1, ros2, head_entries, kind):
    messages = ros1 if kind == "bag" else ros2
    path = messages.write(tmp_path / "head.bag", head_entries(messages), kind=kind)
    (lidar, imu, _), recording = read(path)
    times = joined(lidar, "times")
    assert len(times) == 80 * 100
    assert np.all(np.diff(times) >= 0)
    np.testing.assert_allclose(times[:100], np.arange(100) * 1e-5, atol=1e-9)
    np.testing.assert_allclose(joined(imu, "times"), np.arange(400) / 200, atol=1e-9)
    np.testing.assert_allclose(joined(imu, "gyro")[:, 1], -4.0)
    assert recording.start_ns == START_NS
    assert recording.duration == pytest.approx(1.995, abs=1e-6)
    assert (recording.lidar_topic, recording.imu_topic) == ("/scan", "/imu")
    assert recording.warnings == []
    assert recording.counts == {
        "imu.samples": 400, "lidar.messages": 80, "lidar.returns": 8000,
    }  # fmt: skip


def test_what_is_read_is_logged(tmp_path, ros1, head_entries, caplog):
    path = ros1.write(tmp_path / "head.bag", head_entries(ros1))
    with caplog.at_level("INFO", logger="bentwing"):
        read(path)
    assert "lidar: /scan (sensor_msgs/msg/LaserScan)" in caplog.messages
    assert any("'lidar.returns': 8000" in message for message in caplog.messages)


@pytest.mark.parametrize("given", [3, {"imu": None}])
def test_what_is_no_payload_is_refused_with_what_is_one(tmp_path, given):
    sentence = (
        f"payload: expected a Payload, got {type(given).__name__}; give the path of a payload"
    )
    with pytest.raises(TypeError, match=sentence):
        Recording(tmp_path / "any.bag", given)


def test_a_payload_may_be_given_by_its_file(tmp_path, ros1, head_entries):
    bag = ros1.write(tmp_path / "head.bag", head_entries(ros1))
    path = tmp_path / "payload.yaml"
    path.write_text("T_imu_lidar: {}\n")
    with Recording(bag, path) as by_path, Recording(bag, str(path)) as by_text:
        assert by_path.payload == by_text.payload == Payload.load(path)


@pytest.mark.parametrize("suffix", [".mcap", ".db3"])
def test_a_bare_file_of_a_ros2_bag_is_read(tmp_path, ros2, head_entries, suffix):
    folder = ros2.write(tmp_path / "head", head_entries(ros2), kind=suffix[1:])
    (file,) = folder.glob(f"*{suffix}")
    assert len(joined(read(file)[0][0], "times")) == 8000


def test_a_folder_without_metadata_is_read_file_by_file(tmp_path, ros2, head_entries):
    folder = ros2.write(tmp_path / "head", head_entries(ros2), kind="mcap")
    (folder / "metadata.yaml").unlink()
    assert len(joined(read(folder)[0][0], "times")) == 8000


def test_points_lie_in_the_scan_plane_at_their_beams_angle(tmp_path, ros1):
    ranges = [1.0, 2.0, 3.0]
    scan = ros1.scan(0.0, ranges, angle_min=0.0, angle_increment=np.pi / 2)
    path = ros1.write(tmp_path / "a.bag", [("/scan", 0.0, scan)])
    (lidar, _, _), _ = read(path, NO_IMU)
    np.testing.assert_allclose(
        joined(lidar, "points"), [[1, 0, 0], [0, 2, 0], [-3, 0, 0]], atol=1e-6
    )


def test_invalid_ranges_are_counted_by_reason(tmp_path, ros1):
    ranges = [np.nan, np.inf, 0.0, 0.05, 31.0, 5.0]
    path = ros1.write(tmp_path / "a.bag", [("/scan", 0.0, ros1.scan(0.0, ranges))])
    (lidar, _, _), recording = read(path, NO_IMU)
    assert len(joined(lidar, "times")) == 1
    assert recording.counts == {
        "lidar.messages": 1, "lidar.returns": 6, "lidar.nan": 1, "lidar.inf": 1, "lidar.zero": 1,
        "lidar.out_of_range": 2,
    }  # fmt: skip


def test_batches_can_be_read_again_and_in_part(tmp_path, ros1, head_entries):
    path = ros1.write(tmp_path / "a.bag", head_entries(ros1))
    with Recording(path, HEAD) as recording:
        whole = joined([b for b in recording.batches() if isinstance(b, LidarBatch)], "times")
        part = joined(
            [b for b in recording.batches(0.5, 0.75) if isinstance(b, LidarBatch)], "times"
        )
        again = joined([b for b in recording.batches() if isinstance(b, LidarBatch)], "times")
    np.testing.assert_array_equal(whole, again)
    np.testing.assert_array_equal(part, whole[(whole >= 0.5) & (whole < 1.25)])


def test_a_late_part_is_found_by_seeking(tmp_path, ros1, head_entries):
    path = ros1.write(tmp_path / "a.bag", head_entries(ros1, 20.0))
    (lidar, imu, _), _ = read(path, start=15.0, duration=1.0)
    assert joined(lidar, "times")[[0, -1]] == pytest.approx([15.0, 15.976], abs=1e-3)
    assert len(joined(imu, "times")) == 200


def test_batches_hold_about_a_tenth_of_a_second(tmp_path, ros1, head_entries):
    (lidar, imu, _), _ = read(ros1.write(tmp_path / "a.bag", head_entries(ros1)))
    assert max(np.ptp(batch.times) for batch in imu) < 0.11
    assert max(np.ptp(batch.times) for batch in lidar) < 0.21


def test_encoder_angles_come_out_unwrapped(tmp_path, ros, head_entries):
    path = ros.write(tmp_path / "a.bag", head_entries(ros, encoder=True))
    payload = Payload(encoder={"topic": "/encoder", "T_imu_motor": {}})
    (_, _, encoder), recording = read(path, payload)
    times, angles = joined(encoder, "times"), joined(encoder, "angles")
    np.testing.assert_allclose(angles - angles[0], 4.0 * times, atol=1e-9)
    assert recording.encoder_topic == "/encoder"


def test_consecutive_parts_are_one_recording(tmp_path, ros1, head_entries):
    entries = head_entries(ros1)
    half = len(entries) // 2
    paths = [
        ros1.write(tmp_path / "0.bag", entries[:half]),
        ros1.write(tmp_path / "1.bag", entries[half:]),
    ]
    (lidar, imu, _), recording = read(paths[::-1])
    assert len(joined(lidar, "times")) == 8000
    assert np.all(np.diff(joined(imu, "times")) > 0)
    assert {topic.name: topic.count for topic in recording.topics} == {"/scan": 80, "/imu": 400}


def test_parts_of_different_ros_versions_are_refused(tmp_path, ros1, ros2, head_entries):
    paths = [
        ros1.write(tmp_path / "a.bag", head_entries(ros1, 0.5)),
        ros2.write(tmp_path / "b", head_entries(ros2, 0.5), kind="mcap"),
    ]
    with pytest.raises(RecordingError, match="mix ROS 1 and ROS 2"):
        Recording(paths, HEAD)


def test_livox_points_are_read(tmp_path, ros):
    offsets = np.arange(0, 100_000_000, 1_000_000)
    points = np.column_stack([np.full(100, 5.0), np.zeros(100), np.zeros(100)])
    points[0] = 0
    entries = [("/livox", t, ros.livox(t, offsets, points)) for t in (0.0, 0.1)]
    (lidar, _, _), recording = read(ros.write(tmp_path / "a.bag", entries), NO_IMU)
    np.testing.assert_allclose(joined(lidar, "times")[:3], [0.001, 0.002, 0.003])
    assert recording.counts["lidar.zero"] == 2
    assert "offset_time" in recording.point_times


def test_header_stamps_that_are_all_zero_give_way_to_the_recorders(tmp_path, ros1):
    entries = [("/scan", i / 40, ros1.scan(None)) for i in range(8)]
    (lidar, _, _), recording = read(ros1.write(tmp_path / "a.bag", entries), NO_IMU)
    assert joined(lidar, "times")[-1] == pytest.approx(7 / 40 + 99e-5)
    assert any("header stamps are zero" in text for text in recording.warnings)


def test_stamps_going_backwards_are_dropped_and_told(tmp_path, ros1):
    stamps = [0.0, 0.1, 0.2, 0.1, 0.2, 0.3]
    entries = [("/scan", i / 10, ros1.scan(stamp)) for i, stamp in enumerate(stamps)]
    (lidar, _, _), recording = read(ros1.write(tmp_path / "a.bag", entries), NO_IMU)
    assert len(joined(lidar, "times")) == 400
    assert recording.counts["lidar.backwards_stamps"] == 1
    assert recording.counts["lidar.duplicate_stamps"] == 1
    assert any("going backwards" in text and "/scan" in text for text in recording.warnings)


def test_messages_that_overtook_each_other_are_put_in_order(tmp_path, ros1):
    stamps = [0.0, 0.04, 0.02, 0.06, 0.08]
    entries = [("/scan", i / 10, ros1.scan(stamp)) for i, stamp in enumerate(stamps)]
    (lidar, _, _), recording = read(ros1.write(tmp_path / "a.bag", entries), NO_IMU)
    times = joined(lidar, "times")
    assert len(times) == 500
    assert np.all(np.diff(times) >= 0)
    assert not recording.warnings
    assert recording.clocks["lidar"].n == 5


def test_late_stamps_of_a_host_are_put_where_the_period_says_and_told(tmp_path, ros1):
    late = np.zeros(400)
    late[100::40] = 0.02
    jitter = np.random.default_rng(3).uniform(0.0, 4e-3, 400)
    entries = [
        ("/scan", 0.025 * i + 0.03, ros1.scan(0.025 * i + float(d)))
        for i, d in enumerate(late + jitter)
    ]
    (lidar, _, _), recording = read(ros1.write(tmp_path / "a.bag", entries), NO_IMU)
    starts = joined(lidar, "times")[::100]
    off = starts - 0.025 * np.arange(400)
    assert np.ptp(off) < 1e-3
    assert recording.clocks["lidar"].n_corrected == 400
    assert any("the stamps jitter by 1." in text for text in recording.warnings)


def test_a_long_gap_is_told_and_what_follows_kept(tmp_path, ros1):
    times = [*np.arange(0, 1, 0.025), *np.arange(31, 32, 0.025)]
    entries = [("/scan", t, ros1.scan(t)) for t in times]
    (lidar, _, _), recording = read(ros1.write(tmp_path / "a.bag", entries), NO_IMU)
    assert len(joined(lidar, "times")) == 8000
    assert any("30.0 s from 1.0 s on" in text for text in recording.warnings)
    assert recording.gaps["/scan"] == [pytest.approx((0.975, 30.025))]


def test_a_single_wild_stamp_costs_one_message(tmp_path, ros1):
    stamps = [0.0, 0.1, 1e6, 0.3, 0.4]
    entries = [("/scan", i / 10, ros1.scan(stamp)) for i, stamp in enumerate(stamps)]
    (lidar, _, _), recording = read(ros1.write(tmp_path / "a.bag", entries), NO_IMU)
    assert len(joined(lidar, "times")) == 400
    assert recording.counts["lidar.stamp_jumps"] == 1


def test_overlapping_sweeps_lose_no_point(tmp_path, ros1):
    entries = [("/scan", t, ros1.scan(t, time_increment=0.0011)) for t in np.arange(0, 1, 0.1)]
    (lidar, _, _), _ = read(ros1.write(tmp_path / "a.bag", entries), NO_IMU)
    times = joined(lidar, "times")
    assert len(times) == 1000
    assert np.all(np.diff(times) >= 0)


# What cannot be used


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(RecordingError, match=r"none\.bag: no such file"):
        Recording(tmp_path / "none.bag")


@pytest.mark.parametrize("name", ["a.bag", "a.mcap", "a.db3", "a.txt"])
@pytest.mark.parametrize("content", [b"", b"hello", bytes(range(256)) * 20])
def test_a_file_that_is_no_recording_is_refused(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(RecordingError) as caught:
        Recording(path)
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="without metadata"):
        Recording(tmp_path)


def test_a_bag_without_a_lidar_lists_what_it_has(tmp_path, ros1):
    path = ros1.write(tmp_path / "a.bag", [("/imu", 0.0, ros1.imu(0.0))])
    with pytest.raises(RecordingError, match=r"no lidar topic.*/imu \[sensor_msgs/msg/Imu\]"):
        Recording(path)


def test_an_empty_topic_is_refused(tmp_path, ros2):
    entries = [("/scan", 0.0, "sensor_msgs/msg/LaserScan"), ("/imu", 0.0, ros2.imu(0.0))]
    path = ros2.write(tmp_path / "a", entries)
    with pytest.raises(RecordingError, match=r"/scan \(lidar\) has no messages"):
        Recording(path)


def test_several_lidars_are_listed_until_one_is_named(tmp_path, ros1):
    entries = [(topic, 0.0, ros1.scan(0.0)) for topic in ("/front", "/back")]
    path = ros1.write(tmp_path / "a.bag", entries)
    with pytest.raises(RecordingError, match=r"2 topics could be the lidar: .*/back.*/front"):
        Recording(path)
    with Recording(path, Payload(lidar={"topic": "back"})) as recording:
        assert recording.lidar_topic == "/back"


def test_a_named_topic_that_is_missing_or_of_another_type_is_refused(tmp_path, ros1):
    entries = [("/scan", 0.0, ros1.scan(0.0)), ("/imu", 0.0, ros1.imu(0.0))]
    path = ros1.write(tmp_path / "a.bag", entries)
    with pytest.raises(RecordingError, match="names the lidar topic /lidar"):
        Recording(path, Payload(lidar={"topic": "/lidar"}))
    with pytest.raises(RecordingError, match=r"/imu has the type .*cannot be read as lidar"):
        Recording(path, Payload(lidar={"topic": "/imu"}))


def test_missing_message_definitions_do_not_matter(tmp_path, ros2, head_entries):
    folder = ros2.write(tmp_path / "a", head_entries(ros2), kind="mcap")
    (file,) = folder.glob("*.mcap")
    raw = file.read_bytes()
    definition = b"float32[] ranges"
    assert definition in raw
    file.write_bytes(raw.replace(definition, b"nonsense[[ here!"))
    assert len(joined(read(folder)[0][0], "times")) == 8000


def test_an_unknown_type_is_refused_by_name(tmp_path, ros1):
    entries = [("/lidar", 0.0, ros1.types["std_msgs/msg/String"]("x"))]
    path = ros1.write(tmp_path / "a.bag", entries)
    with pytest.raises(RecordingError, match="std_msgs/msg/String, which cannot be read as lidar"):
        Recording(path, Payload(lidar={"topic": "/lidar"}))


def test_an_imu_the_payload_describes_must_be_there(tmp_path, ros1):
    path = ros1.write(tmp_path / "a.bag", [("/scan", 0.0, ros1.scan(0.0))])
    with pytest.raises(RecordingError, match="describes an IMU, but the recording has no topic"):
        Recording(path, HEAD)


def test_an_imu_needs_its_place_relative_to_the_lidar(tmp_path, ros1, head_entries):
    path = ros1.write(tmp_path / "a.bag", head_entries(ros1, 0.5))
    with pytest.raises(PayloadError, match="give T_imu_lidar"):
        Recording(path)
    with Recording(path, NO_IMU) as recording:
        assert recording.imu_topic is None


def test_an_encoder_the_payload_describes_must_be_there(tmp_path, ros1, head_entries):
    path = ros1.write(tmp_path / "a.bag", head_entries(ros1, 0.5))
    with pytest.raises(RecordingError, match="describes an encoder"):
        Recording(path, Payload(encoder={}))


def test_scans_of_nan_only_are_refused(tmp_path, ros1):
    entries = [("/scan", i / 40, ros1.scan(i / 40, np.full(100, np.nan))) for i in range(4)]
    path = ros1.write(tmp_path / "a.bag", entries)
    with pytest.raises(RecordingError, match=r"no valid return .*400 nan"):
        read(path, NO_IMU)


def test_an_imu_in_g_is_refused_with_the_factor(tmp_path, ros1):
    entries = [("/scan", i / 100, ros1.scan(i / 100)) for i in range(100)]
    entries += [("/imu", i / 100, ros1.imu(i / 100, accel=(0, 0, 1.0))) for i in range(100)]
    path = ros1.write(tmp_path / "a.bag", sorted(entries, key=lambda entry: entry[1]))
    with pytest.raises(RecordingError, match=r"/imu: .* in g .*multiply by 9\.80665"):
        Recording(path, HEAD)


def test_sensors_on_different_clocks_are_refused(tmp_path, ros1):
    entries = [("/scan", i / 100, ros1.scan(i / 100)) for i in range(100)]
    entries += [("/imu", i / 100, ros1.imu(1000 + i / 100)) for i in range(100)]
    path = ros1.write(tmp_path / "a.bag", sorted(entries, key=lambda entry: entry[1]))
    with pytest.raises(RecordingError, match=r"clocks \+1000\.0 s apart"):
        Recording(path, HEAD)


def test_broken_messages_are_counted(tmp_path, ros1):
    entries = [("/scan", i / 40, ros1.scan(i / 40)) for i in range(10)]
    path = ros1.write(tmp_path / "a.bag", entries)
    raw = path.read_bytes()
    # Announce more ranges than there are in one of the scans.
    count = (100).to_bytes(4, "little") + np.full(100, 5.0, "f4").tobytes()[:40]
    at = raw.index(count, raw.index(count) + 1)
    path.write_bytes(raw[:at] + (10**6).to_bytes(4, "little") + raw[at + 4 :])
    (lidar, _, _), recording = read(path, NO_IMU)
    assert recording.counts["lidar.broken_messages"] == 1
    assert len(joined(lidar, "times")) == 900


def test_memory_stays_bounded_by_reading_on_demand(tmp_path, ros1, head_entries):
    path = ros1.write(tmp_path / "a.bag", head_entries(ros1))
    with Recording(path, HEAD) as recording:
        first = list(itertools.islice(recording.batches(), 2))
    assert len(first) == 2


# Real recordings


def test_the_garage_is_read_whole(shared_data):
    with Recording(shared_data / "garage_hdl32.bag") as recording:
        assert "'time' (float32): s, relative" in recording.point_times
        first = next(recording.batches())
    assert first.ring is not None
    assert first.times[0] >= 0


def test_a_ros1_mcap_file_is_read(shared_data):
    with Recording(shared_data / "packets" / "ouster_os1_64.mcap", NO_IMU) as recording:
        assert "'t' (uint32): ns, relative" in recording.point_times
        n = sum(len(batch.times) for batch in recording.batches())
    assert n == 91525
    assert recording.counts["lidar.zero"] == 170619
