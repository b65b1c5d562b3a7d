# SPDX-License-Identifier: MIT OR Apache-2.0
"""Files that were cut off: what is left of them is read, and the loss is told."""

from __future__ import annotations

import numpy as np
import pytest
from rosbags.rosbag1 import Writer

from bentwing.base.errors import RecordingError
from bentwing.recording import LidarBatch, Payload, Recording

NO_IMU = Payload(imu=None)


def times_and_warnings(path):
    with Recording(path, NO_IMU) as recording:
        batches = [b for b in recording.batches() if isinstance(b, LidarBatch)]
        return np.concatenate([batch.times for batch in batches]), recording.warnings


def entries(messages):
    # 5000 beams make several chunks of a megabyte.
    times = np.arange(0, 3, 0.025)
    return [("/scan", t, messages.scan(t, np.full(5000, 5.0), time_increment=1e-6)) for t in times]


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_a_bag_cut_off_is_read_up_to_its_end(tmp_path, ros1, share):
    path = ros1.write(tmp_path / "whole.bag", entries(ros1))
    cut = tmp_path / "cut.bag"
    raw = path.read_bytes()
    cut.write_bytes(raw[: int(share * len(raw))])
    times, warnings = times_and_warnings(cut)
    assert times[-1] == pytest.approx(3 * share, abs=0.1)
    assert len(warnings) == 1
    assert "cut.bag" in warnings[0]
    assert "cut off" in warnings[0]


@pytest.mark.parametrize("compression", list(Writer.CompressionFormat))
def test_compressed_chunks_are_recovered(tmp_path, ros1, compression):
    path = tmp_path / "whole.bag"
    writer = Writer(path)
    writer.set_compression(compression)
    kind = "sensor_msgs/msg/LaserScan"
    rng = np.random.default_rng(1)
    with writer:
        connection = writer.add_connection("/scan", kind, typestore=ros1.store)
        for t in np.arange(0, 3, 0.025):
            ranges = rng.uniform(1, 20, 5000)
            scan = ros1.scan(t, ranges, time_increment=1e-6)
            stamp_ns = 1_700_000_000 * 10**9 + round(t * 1e9)
            writer.write(connection, stamp_ns, ros1.serialize(scan))
    cut = tmp_path / "cut.bag"
    raw = path.read_bytes()
    cut.write_bytes(raw[: int(0.7 * len(raw))])
    times, _ = times_and_warnings(cut)
    assert 1.0 < times[-1] < 2.2


def test_a_bag_whose_recorder_died_has_no_index_and_is_read(tmp_path, ros1):
    path = ros1.write(tmp_path / "whole.bag", entries(ros1))
    whole, _ = times_and_warnings(path)
    raw = path.read_bytes()
    at = raw.index(b"index_pos=") + len(b"index_pos=")
    path.write_bytes(raw[:at] + bytes(8) + raw[at + 8 :])
    times, warnings = times_and_warnings(path)
    np.testing.assert_array_equal(times, whole)
    assert "no complete index" in warnings[0]


@pytest.mark.parametrize("share", [0.4, 0.9])
def test_an_mcap_file_cut_off_is_read_up_to_its_end(tmp_path, ros2, share):
    folder = ros2.write(tmp_path / "whole", entries(ros2), kind="mcap")
    (file,) = folder.glob("*.mcap")
    cut = tmp_path / "cut.mcap"
    raw = file.read_bytes()
    cut.write_bytes(raw[: int(share * len(raw))])
    times, warnings = times_and_warnings(cut)
    assert 3 * share - 1.6 < times[-1] < 3 * share + 0.1
    assert "cut off at byte" in warnings[0]


def test_a_db3_file_cut_off_is_refused_in_one_sentence(tmp_path, ros2):
    folder = ros2.write(tmp_path / "whole", entries(ros2), kind="db3")
    (file,) = folder.glob("*.db3")
    cut = tmp_path / "cut.db3"
    cut.write_bytes(file.read_bytes()[:5000])
    with pytest.raises(RecordingError, match=r"cut\.db3: cannot be read"):
        Recording(cut, NO_IMU)


def test_a_bag_cut_off_before_its_first_message_is_refused(tmp_path, ros1):
    path = ros1.write(tmp_path / "whole.bag", entries(ros1))
    cut = tmp_path / "cut.bag"
    cut.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(RecordingError, match="no message could be read"):
        Recording(cut, NO_IMU)


def test_damage_in_the_middle_ends_the_reading_with_a_warning(tmp_path, ros1):
    path = ros1.write(tmp_path / "whole.bag", entries(ros1))
    raw = bytearray(path.read_bytes())
    middle = len(raw) // 2
    raw[middle : middle + 60_000] = bytes(60_000)
    path.write_bytes(raw)
    times, warnings = times_and_warnings(path)
    assert len(times) > 0
    assert any("damaged" in text for text in warnings)
