# SPDX-License-Identifier: MIT OR Apache-2.0
"""Packets of real sensors: a VLP-16 set by GPS, and an OS1-64 beside the clouds of its driver."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bentwing.base.errors import RecordingError
from bentwing.recording import ImuBatch, LidarBatch, Payload, Recording
from bentwing.recording.containers.source import open_source
from bentwing.recording.messages import point_cloud2, wire
from bentwing.recording.messages.wire_clouds import point_cloud
from bentwing.run.pipeline import map_recording

N_COLUMNS, N_BEAMS = 2048, 64
LIDAR, IMU = "/os1_node/lidar_packets", "/os1_node/imu_packets"
CLOUD, DRIVER_IMU = "/os1_cloud_node/points", "/os1_cloud_node/imu"
FIRST_IMU_NS = 1_622_472_293_890  # the sensor's time of the first IMU packet
CLOUD_NS = 1_622_464_560_570  # and of the second cloud's beginning


@pytest.fixture
def vlp16(shared_data):
    pytest.importorskip("velodyne_decoder", reason='needs pip install "bentwing[packets]"')
    return shared_data / "packets" / "sample_velodyne_vlp16_gps.pcap"


@pytest.fixture
def os1(shared_data):
    pytest.importorskip("ouster.sdk.core", reason="needs pip install --no-deps ouster-sdk==0.16.2")
    return shared_data / "packets" / "ouster_os1_64.mcap"


def read(path, payload=None):
    with Recording(path, payload) as recording:
        batches = list(recording.batches())
    kinds = (LidarBatch, ImuBatch)
    return [[b for b in batches if isinstance(b, kind)] for kind in kinds], recording


def joined(batches, name):
    return np.concatenate([getattr(batch, name) for batch in batches])


def test_a_vlp16_set_by_gps_gives_four_turns_on_its_own_clock(vlp16):
    (lidar, _), recording = read(vlp16)
    assert {(t.name, t.type, t.count) for t in recording.topics} == {
        ("10.0.0.100:2368", "udp/velodyne", 293),
        ("10.0.0.100:8308", "udp/other", 57),
    }
    counts = recording.counts
    assert counts["lidar.packets"] == 293
    assert counts["lidar.returns"] == 293 * 384
    assert counts["lidar.zero"] == 293 * 384 - 73_486
    assert recording.warnings == []
    # 08:18:02.340595 UTC of the day in the GPS packets; the computer was 0.368 s ahead.
    assert recording.start_ns == 1_453_364_282_340_595_000
    assert "the sensor's clock, which is set and counts" in recording.point_times
    assert "0.368043 s behind the computer's" in recording.point_times
    times, points = joined(lidar, "times"), joined(lidar, "points")
    assert np.all(np.diff(times) >= 0)
    assert times[-1] == pytest.approx(0.388363, abs=1e-6)
    # Clockwise, ten times per second.
    azimuths = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
    assert np.polyfit(times, azimuths, 1)[0] == pytest.approx(-2 * np.pi * 10, rel=0.01)


def test_a_vlp16_standing_still_is_mapped_where_it_stands(vlp16, tmp_path):
    run = map_recording(vlp16, None, tmp_path / "out")
    assert json.loads((tmp_path / "out" / "run.json").read_text())["complete"]
    # Four tenths of a second of a lidar alone, with ranges of 3 cm of noise.
    assert np.abs(run.trajectory.positions).max() < 0.03


def clouds(path):
    source = open_source([path])
    found = [point_cloud(raw, cdr=False) for _, _, raw in source.messages({CLOUD})]
    return [point_cloud2._table(cloud).reshape(-1) for cloud in found]


def metadata_from(table):
    """The sensor's angles, read off the driver's cloud: the recording does not have them."""
    points = np.column_stack([table[axis] for axis in "xyz"]).astype(float)
    ranges = table["range"] * 1e-3
    encoder = 2 * np.pi * (1 - np.repeat(np.arange(N_COLUMNS), N_BEAMS) / N_COLUMNS)
    turned = np.arctan2(points[:, 1], points[:, 0]) - encoder
    elevations, azimuths = [], []
    for ring in range(N_BEAMS):
        seen = (table["ring"] == ring) & (ranges > 0)
        elevations.append(np.degrees(np.median(np.arcsin(points[seen, 2] / ranges[seen]))))
        azimuths.append(-np.degrees(np.median(np.angle(np.exp(1j * turned[seen])))))
    return {
        "prod_sn": "991939001266", "build_rev": "v1.13.0", "prod_line": "OS-1-64",
        "lidar_mode": "2048x10",
        # What this driver of 2020 assumed.
        "lidar_origin_to_beam_origin_mm": 0.0,
        "beam_altitude_angles": elevations, "beam_azimuth_angles": azimuths,
        "imu_to_sensor_transform": [1, 0, 0, 6.253, 0, 1, 0, -11.775, 0, 0, 1, 7.645, 0, 0, 0, 1],
        "lidar_to_sensor_transform": [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 36.18, 0, 0, 0, 1],
    }  # fmt: skip


@pytest.fixture
def os1_payload(os1, tmp_path):
    path = tmp_path / "os1.json"
    path.write_text(json.dumps(metadata_from(clouds(os1)[1])))
    mount = {"translation": (-0.006253, 0.011775, 0.028535), "quaternion": (0.0, 0.0, 1.0, 0.0)}
    return Payload(
        lidar={"topic": LIDAR, "metadata": str(path)}, imu={"topic": IMU}, T_imu_lidar=mount
    )


def test_an_os1s_packets_give_the_cloud_that_its_driver_made_of_them(os1, os1_payload):
    (lidar, _), recording = read(os1, os1_payload)
    assert recording.counts["lidar.packets"] == 206
    assert recording.counts["lidar.returns"] == 206 * 16 * N_BEAMS
    stamps_ns = np.rint(joined(lidar, "times") * 1e9).astype(np.int64) + FIRST_IMU_NS
    keys = stamps_ns * N_BEAMS + joined(lidar, "ring")
    table = clouds(os1)[1]
    table = table[table["range"] > 0]
    wanted = (CLOUD_NS + table["t"].astype(np.int64)) * N_BEAMS + table["ring"]
    # The cloud began some packets before the recording did.
    _, ours, theirs = np.intersect1d(keys, wanted, return_indices=True)
    assert len(theirs) == np.sum(wanted >= keys.min()) == 41_843
    expected = np.column_stack([table[axis][theirs] for axis in "xyz"])
    np.testing.assert_allclose(joined(lidar, "points")[ours], expected, atol=1e-5)
    np.testing.assert_array_equal(joined(lidar, "intensity")[ours], table["intensity"][theirs])


def test_an_os1s_imu_packets_give_what_its_driver_published(os1, os1_payload):
    (_, imu), _ = read(os1, os1_payload)
    source = open_source([os1])
    published = [wire.imu(raw, cdr=False) for _, _, raw in source.messages({DRIVER_IMU})]
    values = np.array([np.frombuffer(body, "<f8") for _, body in published])
    stamps_ns = np.array([stamp_ns for stamp_ns, _ in published])
    assert len(values) == 17
    np.testing.assert_allclose(joined(imu, "gyro"), values[:, 13:16], atol=1e-8)
    np.testing.assert_allclose(joined(imu, "accel"), values[:, 25:28], atol=1e-6)
    np.testing.assert_allclose(
        joined(imu, "times"), (stamps_ns - FIRST_IMU_NS) * 1e-9, rtol=0, atol=1e-9
    )


def test_an_os1_without_its_metadata_is_asked_for_them(os1):
    with pytest.raises(RecordingError, match=r"need the metadata .*lidar: {metadata"):
        Recording(os1, Payload(lidar={"topic": LIDAR}, imu=None))
