# SPDX-License-Identifier: MIT OR Apache-2.0
"""An Ouster's packets, of a wall that is known, as a user opens them."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

from bentwing.base.errors import PayloadError, RecordingError
from bentwing.recording import ImuBatch, LidarBatch, Payload, Recording
from support.ouster_packets import (
    AZIMUTHS_DEG,
    COLUMN_NS,
    ELEVATIONS_DEG,
    METADATA,
    MOUNT,
    N_BEAMS,
    N_COLUMNS,
    core,
    imu_packets,
    lidar_packets,
)

START_NS = 1_700_000_000 * 10**9


def entries(messages, duration=0.4, *, metadata=METADATA, imu=True, tail=b""):
    """Entries of a bag of a sensor whose packets arrive 1 ms late."""
    found = [] if metadata is None else [("/ouster/metadata", 0.0, messages.string(metadata))]
    for t_ns, data in lidar_packets(duration):
        t = (t_ns + 15 * COLUMN_NS) * 1e-9 + 1e-3
        found.append(("/ouster/lidar_packets", t, messages.ouster_packet(data + tail)))
    for t_ns, data in imu_packets(duration) if imu else []:
        found.append(("/ouster/imu_packets", t_ns * 1e-9 + 1e-3, messages.ouster_packet(data)))
    return sorted(found, key=lambda entry: entry[1])


def read(path, payload=None):
    with Recording(path, payload or Payload(T_imu_lidar=MOUNT)) as recording:
        batches = list(recording.batches())
    kinds = (LidarBatch, ImuBatch)
    return [[b for b in batches if isinstance(b, kind)] for kind in kinds], recording


def joined(batches, name):
    return np.concatenate([getattr(batch, name) for batch in batches])


def test_points_lie_on_the_wall_with_their_beams_and_times(tmp_path, ros):
    """In the lidar's own frame, as the ROS driver publishes; ranges are whole millimetres."""
    (lidar, _), recording = read(ros.write(tmp_path / "a.bag", entries(ros)))
    points, ring = joined(lidar, "points"), joined(lidar, "ring")
    np.testing.assert_allclose(points[:, 0], 4.0, atol=0.6e-3)
    slopes = np.tan(np.radians(ELEVATIONS_DEG))[ring]
    np.testing.assert_allclose(
        points[:, 2], slopes * np.hypot(points[:, 0], points[:, 1]), atol=1e-3
    )
    times = joined(lidar, "times")
    columns = times * 1e9 / COLUMN_NS
    np.testing.assert_allclose(columns, np.rint(columns), atol=1e-4)
    # The encoder counts clockwise.
    turned = 2 * np.pi * (1 - np.rint(columns) / N_COLUMNS) - np.radians(AZIMUTHS_DEG)[ring]
    difference = np.arctan2(points[:, 1], points[:, 0]) - turned
    np.testing.assert_allclose(np.angle(np.exp(1j * difference)), 0, atol=1e-9)
    assert np.all(np.diff(times) >= 0)
    assert np.all(joined(lidar, "intensity") == 77)
    assert recording.warnings == []


def test_firings_without_return_are_counted(tmp_path, ros1):
    (lidar, _), recording = read(ros1.write(tmp_path / "a.bag", entries(ros1)))
    counts = recording.counts
    assert counts["lidar.returns"] == counts["lidar.packets"] * 16 * N_BEAMS
    assert counts["lidar.returns"] - counts["lidar.zero"] == len(joined(lidar, "times"))
    assert 0.6 < counts["lidar.zero"] / counts["lidar.returns"] < 0.72


def test_the_imus_samples_are_in_si_units_and_on_the_lidars_clock(tmp_path, ros):
    (_, imu), recording = read(ros.write(tmp_path / "a.bag", entries(ros)))
    np.testing.assert_allclose(joined(imu, "accel"), [[0, 0, 9.80665]] * 40, atol=1e-6)
    np.testing.assert_allclose(joined(imu, "gyro"), [[np.pi / 2, 0, 0]] * 40, atol=1e-6)
    np.testing.assert_allclose(joined(imu, "times"), np.arange(40) * 0.01, atol=1e-9)
    assert recording.imu_topic == "/ouster/imu_packets"
    assert "the sensor's clock, put at the computer's time at the start" in recording.point_times


def test_an_imu_of_its_own_is_preferred_to_the_lidars(tmp_path, ros1):
    own = [("/imu", t, ros1.imu(t)) for t in np.arange(0, 0.4, 0.01)]
    both = sorted(entries(ros1) + own, key=lambda entry: entry[1])
    _, recording = read(ros1.write(tmp_path / "a.bag", both))
    assert recording.imu_topic == "/imu"
    assert "put at the computer's time and kept there" in recording.point_times


def test_packets_of_older_drivers_end_in_a_byte_too_many(tmp_path, ros1):
    (lidar, _), recording = read(ros1.write(tmp_path / "a.bag", entries(ros1, tail=b"\0")))
    np.testing.assert_allclose(joined(lidar, "points")[:, 0], 4.0, atol=0.6e-3)
    assert recording.warnings == []


def test_a_capture_gives_what_a_bag_gives(tmp_path, ros1, packets):
    """A lidar packet is larger than a frame of the network, so it is captured in fragments."""
    kinds = ((7502, lidar_packets(0.4)), (7503, imu_packets(0.4)))
    frames = [
        (START_NS + t_ns + 2_464_840, packets.ethernet(packet))
        for port, sent in kinds
        for i, (t_ns, data) in enumerate(sent)
        for packet in packets.udp(data, port=port, identity=i)
    ]
    capture = packets.write_pcap(tmp_path / "a.pcap", sorted(frames, key=lambda frame: frame[0]))
    metadata = tmp_path / "os1.json"
    metadata.write_text(METADATA)
    payload = Payload(lidar={"metadata": str(metadata)}, T_imu_lidar=MOUNT)
    found, recording = read(capture, payload)
    expected, _ = read(ros1.write(tmp_path / "a.bag", entries(ros1)))
    for batches, others in zip(found, expected, strict=True):
        np.testing.assert_allclose(joined(batches, "times"), joined(others, "times"), atol=1e-9)
    np.testing.assert_array_equal(joined(found[0], "points"), joined(expected[0], "points"))
    assert recording.lidar_topic == "192.168.1.201:7502"


def test_the_payload_names_the_metadata_beside_itself(tmp_path, ros1):
    (tmp_path / "head").mkdir()
    (tmp_path / "head" / "os1.json").write_text(METADATA)
    payload = tmp_path / "head" / "payload.yaml"
    payload.write_text("lidar: {metadata: os1.json}\nimu: null\n")
    path = ros1.write(tmp_path / "a.bag", entries(ros1, metadata=None))
    (lidar, imu), _ = read(path, Payload.load(payload))
    np.testing.assert_allclose(joined(lidar, "points")[:, 0], 4.0, atol=0.6e-3)
    assert imu == []


def test_without_metadata_one_sentence_says_how_to_get_them(tmp_path, ros1):
    path = ros1.write(tmp_path / "a.bag", entries(ros1, metadata=None))
    with pytest.raises(
        RecordingError, match=r"need the metadata .*curl .*lidar: {metadata"
    ) as raised:
        Recording(path)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (
            {
                "pixels_per_column": 64,
                "pixel_shift_by_row": [0] * 64,
                "beam_altitude_angles": [0.0] * 64,
                "beam_azimuth_angles": [0.0] * 64,
                "prod_line": "OS-1-64",
            },
            "packets of 6464 bytes where the metadata say 12608",
        ),
        (
            {"lidar_mode": "2048x10", "columns_per_frame": 2048, "column_window": [0, 2047]},
            "packets of 10240 columns per second where the metadata say 2048 x 10",
        ),
        (None, "not the metadata of an Ouster sensor"),
    ],
)
def test_metadata_that_do_not_fit_are_refused(tmp_path, ros1, changes, sentence):
    text = "{}"
    if changes is not None:
        other = json.loads(METADATA)
        for name, value in changes.items():
            (other["data_format"] if name in other["data_format"] else other)[name] = value
        text = json.dumps(other)
    path = ros1.write(tmp_path / "a.bag", entries(ros1, metadata=text))
    with pytest.raises(RecordingError, match=sentence) as raised:
        Recording(path)
    assert "\n" not in str(raised.value)


def test_metadata_that_are_not_there_are_the_payloads_error(tmp_path, ros1):
    path = ros1.write(tmp_path / "a.bag", entries(ros1, metadata=None))
    with pytest.raises(PayloadError, match=r"lidar\.metadata: nowhere\.json cannot be read"):
        Recording(path, Payload(lidar={"metadata": "nowhere.json"}))


def test_columns_that_the_sensor_calls_invalid_are_left_out(tmp_path, ros1):
    """One column of each packet, and all of every fourth as outside an azimuth window."""
    cut = entries(ros1)
    writer = core.PacketWriter.from_info(core.SensorInfo(METADATA))
    lidar = [i for i, (topic, _, _) in enumerate(cut) if topic == "/ouster/lidar_packets"]
    for n, i in enumerate(lidar):
        topic, t, message = cut[i]
        packet = core.LidarPacket(len(message.buf))
        packet.buf[:] = message.buf
        for column in range(16) if n % 4 == 0 else [3]:
            writer.set_col_status(packet, column, 0)
        cut[i] = (topic, t, ros1.ouster_packet(packet.buf.tobytes()))
    _, recording = read(ros1.write(tmp_path / "a.bag", cut))
    n_whole = len(range(0, len(lidar), 4))
    assert recording.counts["lidar.returns"] == (len(lidar) - n_whole) * 15 * N_BEAMS
    assert recording.warnings == []


def test_without_the_library_one_sentence_says_what_to_install(tmp_path, ros1, monkeypatch):
    path = ros1.write(tmp_path / "a.bag", entries(ros1))
    monkeypatch.setitem(sys.modules, "ouster.sdk.core", None)
    with pytest.raises(RecordingError, match=r"pip install --no-deps ouster-sdk==") as raised:
        Recording(path)
    assert "\n" not in str(raised.value)
