# SPDX-License-Identifier: MIT OR Apache-2.0
"""Packets of Hesai's and RoboSense's lidars before a wall, from captures and from their drivers."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base.errors import PayloadError, RecordingError
from bentwing.recording import LidarBatch, Payload, Recording
from bentwing.recording.packets import hesai
from support.block_lidars import (
    LIDARS,
    RS_AZIMUTHS,
    RS_ELEVATIONS,
    TURN_US,
    WALL,
    device_packet,
    packets_of,
)

START_US = 1_700_000_000 * 10**6
DELAY_NS = 1_400_000
ROBOSENSE = ("rs16", "rs32", "helios", "airy")
NAMED = {"rs16", "rs32"}  # whose packets look alike
HESAI = tuple(name for name in LIDARS if name not in ROBOSENSE)
every_model = pytest.mark.parametrize("model", LIDARS)


def payload_of(model, **values):
    named = {"model": model} if model in NAMED else {}
    return Payload.model_validate({"lidar": named | values, "imu": None})


def capture(packets, path, model, found, *, device=None):
    """Write the packets of a model; RoboSense's with one about the device behind some others."""
    frames = [
        (START_US * 1000 + round(t_us * 1000) + DELAY_NS, packets.ethernet(part))
        for i, (t_us, payload) in enumerate(found)
        for part in packets.udp(payload, identity=i)
    ]
    if model in ROBOSENSE and device != b"":
        about = packets.udp(device or device_packet(model), port=7788)
        frames[5:5] = [(frames[5][0], packets.ethernet(part)) for part in about]
    return packets.write_pcap(path, frames)


def read(path, payload):
    with Recording(path, payload) as recording:
        batches = [one for one in recording.batches() if isinstance(one, LidarBatch)]
        return LidarBatch(
            np.concatenate([one.points for one in batches]),
            np.concatenate([one.times for one in batches]),
            np.concatenate([one.intensity for one in batches]),
            np.concatenate([one.ring for one in batches]),
        ), recording


@pytest.fixture
def turn(tmp_path, packets):
    """Reads two turns of a model."""

    def make(model, **values):
        lidar = LIDARS[model]
        per_packet = lidar.n_blocks // (2 if "weak" in values else 1)
        n = round(2 * TURN_US / lidar.block_us / per_packet)
        found = packets_of(lidar, START_US, n, **values)
        device = device_packet(model, is_dual="weak" in values) if model in ROBOSENSE else None
        path = capture(packets, tmp_path / f"{model}.pcap", model, found, device=device)
        return *read(path, payload_of(model)), n

    return make


def ahead_of(model, points):
    """How far ahead and to the right, in the frame of the maker's driver."""
    return (points[:, 0], -points[:, 1]) if model in ROBOSENSE else (points[:, 1], points[:, 0])


def beams_of(model):
    """Elevation and azimuth of each ring, degrees."""
    if model not in ROBOSENSE:
        return tuple(np.array([getattr(c, name) for c in LIDARS[model].channels]) for name in ("elevation", "azimuth"))  # fmt: skip
    order = np.argsort(RS_ELEVATIONS[model])
    return np.array(RS_ELEVATIONS[model])[order], np.array(RS_AZIMUTHS[model])[order]


@every_model
def test_points_lie_on_the_wall_at_the_elevations_of_their_rings(turn, model):
    """Ranges are rounded to half a unit, azimuths to 0.005°, over up to 13 m at a slant of 60°."""
    batch, _, _ = turn(model)
    ahead, right = ahead_of(model, batch.points)
    np.testing.assert_allclose(ahead, WALL, atol=8e-3)
    assert right.min() < -3.0
    assert right.max() > 3.0
    elevations, _ = beams_of(model)
    rotor = np.radians(360e6 * batch.times / TURN_US)
    lens = LIDARS[model].lens
    level = np.hypot(ahead - lens * np.cos(rotor), right - lens * np.sin(rotor))
    found = np.degrees(np.arctan2(batch.points[:, 2] - LIDARS[model].height, level))
    np.testing.assert_allclose(found, elevations[batch.ring], atol=0.05)


@every_model
def test_the_time_of_a_point_is_that_when_the_rotor_looked_there(turn, model):
    """The azimuths are rounded to 0.01°, which the rotor turns in 2.8 µs."""
    batch, recording, _ = turn(model)
    assert np.all(np.diff(batch.times) >= 0)
    ahead, right = ahead_of(model, batch.points)
    _, azimuths = beams_of(model)
    first_us = recording.start_ns / 1000 - START_US
    rotor = np.radians(360 * (batch.times * 1e6 + first_us) / TURN_US)
    lens = LIDARS[model].lens
    look = np.degrees(np.arctan2(right - lens * np.sin(rotor), ahead - lens * np.cos(rotor)))
    off = (look - azimuths[batch.ring] - np.degrees(rotor) + 180) % 360 - 180
    assert np.abs(off).max() < 0.03


@every_model
def test_firings_without_return_are_counted(turn, model):
    batch, recording, n_packets = turn(model)
    lidar = LIDARS[model]
    n_fired = n_packets * lidar.n_blocks * len(lidar.channels)
    assert recording.counts["lidar.returns"] == n_fired
    assert recording.counts["lidar.zero"] == n_fired - len(batch.times)


@pytest.mark.parametrize("model", [*HESAI, "rs32", "helios", "airy"])
def test_of_two_returns_the_stronger_is_kept(turn, model):
    batch, _, _ = turn(model, weak=2.0)
    ahead, _ = ahead_of(model, batch.points)
    on_wall = batch.intensity == 40
    np.testing.assert_allclose(ahead[on_wall], WALL, atol=8e-3)
    weak = np.linalg.norm(batch.points[~on_wall], axis=1)  # where the wall is out of sight
    off = LIDARS[model].lens + LIDARS[model].height
    np.testing.assert_allclose(weak, 2.0, atol=off + 1e-3)


def test_of_two_returns_in_the_block_of_an_rs16_the_stronger_is_kept(tmp_path, packets):
    lidar = LIDARS["rs16"]
    found = []
    for number in range(40):
        begins = [(12 * number + i) * 55.5 for i in range(12)]
        blocks = [
            (round(36000 * t / TURN_US) % 36000, [(400, 5)] * 16 + lidar.firing(t, lambda *_: WALL)[:16])
            for t in begins
        ]  # fmt: skip
        found.append((begins[0], lidar.write(START_US + round(begins[0]), blocks, is_dual=True)))
    device = device_packet("rs16", is_dual=True)
    path = capture(packets, tmp_path / "a.pcap", "rs16", found, device=device)
    batch, recording = read(path, payload_of("rs16"))
    assert recording.counts["lidar.returns"] == 40 * 12 * 16
    assert set(batch.intensity) == {40.0}
    np.testing.assert_allclose(
        np.diff(np.unique(np.round(batch.times * 1e6, 1)))[:15], 2.8, atol=0.11
    )


@every_model
def test_damaged_packets_are_counted_and_left_out(tmp_path, packets, model):
    found = packets_of(LIDARS[model], START_US, 60)
    wrong = bytearray(found[20][1])
    first = {"rs16": 42, "rs32": 42, "helios": 42, "airy": 42, "40p": 0}.get(model, 12)
    azimuth = (
        slice(first + 2, first + 4) if model in {*ROBOSENSE, "40p"} else slice(first, first + 2)
    )
    wrong[azimuth] = b"\xfe\xfe"
    found[20] = (found[20][0], bytes(wrong))
    found[30] = (found[30][0], found[30][1][:-40])
    path = capture(packets, tmp_path / "a.pcap", model, found)
    _, recording = read(path, payload_of(model))
    counts = recording.counts
    # A shorter datagram may be no packet of the maker's any more, and is then other traffic.
    assert counts["lidar.packets"] == 58
    assert counts["lidar.broken_packets"] in {1, 2}


@every_model
def test_damage_of_any_kind_gives_finite_points(tmp_path, packets, model):
    rng = np.random.default_rng(101)
    found = packets_of(LIDARS[model], START_US, 60)
    for i in rng.integers(5, 60, 40):
        t_us, packet = found[i]
        noise = bytearray(packet)
        for at in rng.integers(4, len(packet), 20):
            noise[at] = rng.integers(0, 256)
        found[i] = (t_us, bytes(noise))
    batch, _ = read(capture(packets, tmp_path / "a.pcap", model, found), payload_of(model))
    assert np.isfinite(batch.points).all()
    assert np.linalg.norm(batch.points, axis=1).max() < 65536 * LIDARS[model].unit + 0.1


@pytest.mark.parametrize(
    "ros_kind", ["hesai_lidar/msg/PandarScan", "hesai_ros_driver/msg/UdpFrame"]
)
def test_scans_of_hesais_drivers_are_read(tmp_path, ros, ros_kind):
    found = packets_of(LIDARS["xt32"], START_US, 250)
    entries = [
        ("/lidar_packets", i / 500, ros.hesai_scan(ros_kind, i / 500, [p for _, p in found[i : i + 50]]))
        for i in range(0, 250, 50)
    ]  # fmt: skip
    path = ros.write(tmp_path / ("a.bag" if ros.ros1 else "a"), entries)
    batch, recording = read(path, payload_of("xt32"))
    assert recording.counts["lidar.packets"] == 250
    ahead, _ = ahead_of("xt32", batch.points)
    np.testing.assert_allclose(ahead, WALL, atol=8e-3)


def test_packets_of_robosenses_driver_are_read_with_the_device_among_them(tmp_path, ros):
    found = packets_of(LIDARS["helios"], START_US, 150)
    packets = [packet for _, packet in found]
    packets.insert(9, device_packet("helios"))
    entries = [
        ("/rslidar_packets", i / 1500, ros.rslidar_packet(i / 1500, packet, is_device=i == 9))
        for i, packet in enumerate(packets)
    ]
    path = ros.write(tmp_path / ("a.bag" if ros.ros1 else "a"), entries)
    batch, recording = read(path, payload_of("helios"))
    assert recording.counts["lidar.packets"] == 150
    assert recording.counts["lidar.broken_packets"] == 0
    ahead, _ = ahead_of("helios", batch.points)
    np.testing.assert_allclose(ahead, WALL, atol=8e-3)


def test_a_robosense_without_its_angles_is_refused_with_what_to_record(tmp_path, packets):
    found = packets_of(LIDARS["helios"], START_US, 40)
    path = capture(packets, tmp_path / "a.pcap", "helios", found, device=b"")
    with pytest.raises(RecordingError, match=r"DIFOP, sent to port 7788.*record them too"):
        Recording(path, payload_of("helios"))


@pytest.mark.parametrize(
    ("model", "told", "says"),
    [("rs32", None, "rs16 or rs32"), ("rs32", "helios", "but the payload says 'model: helios'"),
     ("helios", "rs32", r"packets of a Helios, but.*\(helios\)"),
     ("airy", "rs32", r"packets of an Airy, but.*\(airy\)")],
)  # fmt: skip
def test_a_model_that_is_not_told_or_told_wrongly_is_refused(tmp_path, packets, model, told, says):
    path = capture(packets, tmp_path / "a.pcap", model, packets_of(LIDARS[model], START_US, 40))
    values = {} if told is None else {"model": told}
    payload = Payload.model_validate({"lidar": values, "imu": None})
    with pytest.raises(RecordingError, match=says):
        Recording(path, payload)


def test_an_airy_of_48_channels_is_read_and_one_of_192_refused(tmp_path, packets):
    lidar = LIDARS["airy"]
    found = []
    for number in range(60):
        begin = number * 8 * lidar.block_us
        rows = [(round(36000 * (begin + i * lidar.block_us) / TURN_US) % 36000) for i in range(8)]
        # Halves of 48 channels are blocks of their own here: one firing each.
        blocks = [(rows[i], [(800, 9)] * 48 + [(800, 9)] * 48) for i in range(0, 8, 2)]
        packet = bytearray(lidar.write(START_US + round(begin), blocks, is_dual=False))
        for i, azimuth in enumerate(rows):
            packet[42 + 148 * i + 2 : 42 + 148 * i + 4] = azimuth.to_bytes(2, "big")
        packet[32] = 1
        found.append((begin, bytes(packet)))
    batch, recording = read(
        capture(packets, tmp_path / "a.pcap", "airy", found), payload_of("airy")
    )
    assert recording.counts["lidar.returns"] == 60 * 8 * 48
    assert set(batch.ring) == set(range(48))
    starts = np.unique(np.round(batch.times[batch.ring == 0] * 1e6, 1))
    np.testing.assert_allclose(starts, np.arange(480) * lidar.block_us, atol=1.0)
    wide = [(t, packet[:32] + b"\x03" + packet[33:]) for t, packet in found]
    path = capture(packets, tmp_path / "b.pcap", "airy", wide)
    with pytest.raises(RecordingError, match="an Airy with 192 channels"):
        Recording(path, payload_of("airy"))


def test_another_hesai_is_refused_with_those_that_can_be_read(tmp_path, packets):
    packet = b"\xee\xff\x01\x04\0\0\x80\x02\x02\x04\x02\x01" + bytes(849)
    path = packets.write_datagrams(
        tmp_path / "a.pcap", [(START_US * 1000 + i, packet) for i in range(9)]
    )
    with pytest.raises(RecordingError, match=r"128 channels and protocol 1\.4.*Pandar40P"):
        Recording(path, payload_of("xt32"))


def test_the_angles_of_the_single_hesai_are_taken_from_its_file(tmp_path, packets):
    rows = [f"{i + 1},{15.5 - i},{0.25}" for i in range(32)]
    (tmp_path / "angles.csv").write_text("\n".join(["Channel,Elevation,Azimuth", *rows]))
    path = capture(packets, tmp_path / "a.pcap", "xt32", packets_of(LIDARS["xt32"], START_US, 250))
    nominal, _ = read(path, payload_of("xt32"))
    own, _ = read(path, payload_of("xt32", metadata=str(tmp_path / "angles.csv")))
    for name, points in (("elevation", nominal.points), ("own", own.points)):
        level = np.hypot(points[:, 0], points[:, 1])
        angles = np.degrees(np.arctan2(points[:, 2], level)) + nominal.ring
        np.testing.assert_allclose(angles, 15.0 if name == "elevation" else 15.5, atol=1e-6)
    turned = np.arctan2(own.points[:, 0], own.points[:, 1]) - np.arctan2(
        nominal.points[:, 0], nominal.points[:, 1]
    )
    np.testing.assert_allclose(np.degrees(turned), 0.25, atol=1e-6)
    (tmp_path / "angles.csv").write_text("Channel,Elevation,Azimuth\n1,2,3")
    with pytest.raises(PayloadError, match="has 1 channels, expected 1 to 32"):
        read(path, payload_of("xt32", metadata=str(tmp_path / "angles.csv")))


def test_the_tables_of_hesai_have_each_channel_and_fall_or_rise():
    for elevations, azimuths, firing in (
        (hesai.P40_ELEVATIONS, hesai.P40_AZIMUTHS, hesai.P40_FIRING_US),
        (hesai.QT_ELEVATIONS, hesai.QT_AZIMUTHS, hesai.QT_FIRING_US),
    ):
        assert len(elevations) == len(azimuths) == len(firing)
        assert len(set(np.sign(np.diff(elevations)))) == 1
    # from the manual's channel distribution: channels 7, 14 and 40, and those that fire last and first
    assert [hesai.P40_AZIMUTHS[i - 1] for i in (6, 7, 8, 9, 30, 31)] == [-1.042, 3.125, -5.208, -1.042, -1.042, -1.042]  # fmt: skip
    assert hesai.P40_FIRING_US.index(min(hesai.P40_FIRING_US)) + 1 == 8
    assert {i + 1 for i, us in enumerate(hesai.P40_FIRING_US) if us == -3.62} == {4, 40}
