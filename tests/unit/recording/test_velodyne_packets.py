# SPDX-License-Identifier: MIT OR Apache-2.0
"""A Velodyne's packets, of walls that are known, as a user opens them."""

from __future__ import annotations

import sys
from collections import Counter

import numpy as np
import pytest

from bentwing.base.errors import RecordingError
from bentwing.calibrate.inspection import inspect
from bentwing.recording import ImuBatch, LidarBatch, Payload, Recording

pytest.importorskip("velodyne_decoder", reason='needs pip install "bentwing[packets]"')

HOUR_NS = 3600 * 10**9
START_NS = 1_700_000_000 * 10**9
START_US = START_NS % HOUR_NS // 1000  # of a sensor whose clock is set
DELAY_NS = 1_400_000


def captured(turns, *, start_ns=START_NS, delay_ns=DELAY_NS):
    return [(start_ns + t_us * 1000 + delay_ns, packet) for t_us, packet in turns]


def read(path, payload=None, **values):
    with Recording(path, payload, **values) as recording:
        batches = list(recording.batches())
    return [batch for batch in batches if isinstance(batch, LidarBatch)], recording


def joined(batches, name):
    return np.concatenate([getattr(batch, name) for batch in batches])


@pytest.fixture
def wall_capture(tmp_path, packets):
    turns = packets.vlp16_turns(0.5, first_us=START_US)
    return packets.write_datagrams(tmp_path / "wall.pcap", captured(turns))


def test_points_lie_on_the_wall_ahead_with_z_up(wall_capture, packets):
    """Ranges are rounded to 2 mm, angles by the decoder to 0.01°, which the slant doubles.

    The lasers sit up to 11.2 mm above and below the origin.
    """
    lidar, _ = read(wall_capture)
    points, ring = joined(lidar, "points"), joined(lidar, "ring")
    np.testing.assert_allclose(points[:, 0], 4.0, atol=4e-3)
    slopes = np.tan(np.radians(np.sort(packets.elevations_deg)))[ring]
    heights = slopes * np.hypot(points[:, 0], points[:, 1])
    np.testing.assert_allclose(points[:, 2], heights, atol=11.2e-3 + 0.5e-3)


def test_the_sensor_turns_clockwise_seen_from_above(wall_capture):
    """The encoder counts clockwise, so a turn sweeps the wall from left, y > 0, to right."""
    lidar, _ = read(wall_capture)
    times, points = joined(lidar, "times"), joined(lidar, "points")
    ahead = (times > 0.085) & (times < 0.115)
    assert np.polyfit(times[ahead], points[ahead, 1], 1)[0] < 0


def test_every_firing_has_its_own_time(wall_capture):
    lidar, recording = read(wall_capture)
    times, ring = joined(lidar, "times"), joined(lidar, "ring")
    assert recording.start_ns == START_NS
    assert np.all(np.diff(times) >= 0)
    # Every second elevation of the sorted ones belongs to an odd laser, in the order of firing.
    laser = np.where(ring < 8, 2 * ring, 2 * (ring.astype(int) - 8) + 1)
    since_firing = (times * 1e6 - laser * 2.304) / 55.296
    # The packets' stamps are whole microseconds.
    assert np.abs(since_firing - np.rint(since_firing)).max() * 55.296 < 0.51 + 0.02


def test_firings_without_return_are_counted(wall_capture):
    lidar, recording = read(wall_capture)
    n_packets = recording.topics[0].count
    counts = recording.counts
    assert counts["lidar.returns"] == 384 * n_packets
    assert counts["lidar.returns"] - counts["lidar.zero"] == len(joined(lidar, "times"))
    assert 0.6 < counts["lidar.zero"] / counts["lidar.returns"] < 0.72
    assert counts["lidar.packets"] == counts["lidar.messages"] == n_packets
    assert recording.warnings == []


def test_the_inspection_finds_a_capture_fit_for_mapping(wall_capture):
    found = inspect(wall_capture)
    assert found.is_fit
    assert [(topic.type, topic.role) for topic in found.topics] == [("udp/velodyne", "lidar")]
    assert found.topics[0].rate_hz == pytest.approx(1e6 / (12 * 110.592), rel=0.01)


def test_batches_are_streamed_a_tenth_of_a_second_each(wall_capture):
    lidar, _ = read(wall_capture)
    assert max(np.ptp(batch.times) for batch in lidar) < 0.21
    assert len(lidar) >= 4


def test_of_two_returns_the_strongest_is_kept(tmp_path, packets):
    def two(angles, elevations):
        near = packets.wall(angles, elevations)
        return 2 * near, near

    turns = packets.vlp16_turns(0.2, first_us=START_US, ranges=two, returns=0x39)
    lidar, recording = read(packets.write_datagrams(tmp_path / "a.pcap", captured(turns)))
    np.testing.assert_allclose(joined(lidar, "points")[:, 0], 4.0, atol=4e-3)
    counts = recording.counts
    assert counts["lidar.returns"] == 192 * len(turns)
    assert counts["lidar.returns"] - counts["lidar.zero"] == len(joined(lidar, "times"))


@pytest.mark.parametrize("returns", [0x38, 0x00])
def test_the_only_return_is_kept_whatever_it_is_called(tmp_path, packets, returns):
    """Last return, and firmware from before there was a choice."""
    turns = packets.vlp16_turns(0.2, first_us=START_US)
    other = packets.vlp16_turns(0.2, first_us=START_US, returns=returns)
    expected, _ = read(packets.write_datagrams(tmp_path / "a.pcap", captured(turns)))
    lidar, recording = read(packets.write_datagrams(tmp_path / "b.pcap", captured(other)))
    np.testing.assert_array_equal(joined(lidar, "points"), joined(expected, "points"))
    assert recording.counts["lidar.returns"] == 384 * len(turns)


def test_the_top_of_the_hour_is_passed_without_a_step(tmp_path, packets):
    first_us = 3_600_000_000 - 200_000
    start_ns = START_NS // HOUR_NS * HOUR_NS + first_us * 1000
    turns = packets.vlp16_turns(0.5, first_us=first_us)
    path = packets.write_datagrams(tmp_path / "a.pcap", captured(turns, start_ns=start_ns))
    lidar, recording = read(path)
    times = joined(lidar, "times")
    assert recording.start_ns == start_ns
    assert recording.warnings == []
    seen = np.diff(np.concatenate([[0.0], times, [0.5]]))
    assert seen.max() < 0.075  # two thirds of a turn without the wall
    assert times[-1] < 0.5


def test_a_computer_just_past_the_hour_does_not_shift_the_sensor_by_one(tmp_path, packets):
    first_us = 3_600_000_000 - 1_000
    start_ns = START_NS // HOUR_NS * HOUR_NS + first_us * 1000
    turns = packets.vlp16_turns(0.2, first_us=first_us)
    capture = captured(turns, start_ns=start_ns, delay_ns=50_000_000)
    _, recording = read(packets.write_datagrams(tmp_path / "a.pcap", capture))
    assert recording.start_ns == start_ns


def test_a_clock_that_is_set_is_taken_as_it_is(wall_capture):
    _, recording = read(wall_capture)
    assert "the sensor's clock, which is set and counts" in recording.point_times
    assert "0.001400 s behind the computer's" in recording.point_times
    assert "top of the hour" in recording.point_times


def test_a_clock_that_was_never_set_gives_intervals_only(tmp_path, packets):
    """The fastest of the first packets tells the difference; jitter does not reach the points."""
    turns = packets.vlp16_turns(0.5, first_us=77_000_000)
    jitter = np.random.default_rng(0).integers(0, 900_000, len(turns)) * 1
    jitter[5] = 0
    capture = [
        (START_NS + t_us * 1000 + DELAY_NS + int(late), packet)
        for (t_us, packet), late in zip(turns, jitter, strict=True)
    ]
    lidar, recording = read(packets.write_datagrams(tmp_path / "a.pcap", capture))
    assert "put at the computer's time at the start" in recording.point_times
    assert recording.start_ns == pytest.approx(START_NS + DELAY_NS, abs=1000)
    reference, _ = read(
        packets.write_datagrams(
            tmp_path / "b.pcap", captured(packets.vlp16_turns(0.5, first_us=START_US))
        )
    )
    np.testing.assert_allclose(joined(lidar, "times"), joined(reference, "times"), atol=1e-8)


def test_beside_an_imu_the_clock_follows_the_computers(tmp_path, packets, ros):
    """A crystal 80 ppm too fast gains 1.6 ms in 20 s, of which the last second is left."""
    drift, duration = 80e-6, 20.0
    turns = packets.vlp16_turns(
        duration, first_us=77_000_000, every=20, ranges=lambda angles, _: 0 * angles + 5.0
    )
    late = np.random.default_rng(0).exponential(3e-4, len(turns))
    computers = np.array([t_us * 1e-6 * (1 - drift) for t_us, _ in turns])
    entries = [("/imu", t, ros.imu(t)) for t in np.arange(0, duration, 0.05)]
    for computer, delay, (_, packet) in zip(computers, late, turns, strict=True):
        t = computer + delay
        entries.append(("/velodyne_packets", t, ros.velodyne_scan(t, [(t, packet)])))
    path = ros.write(tmp_path / "a.bag", sorted(entries, key=lambda entry: entry[1]))
    with Recording(path, Payload(T_imu_lidar={})) as recording:
        assert "put at the computer's time and kept there" in recording.point_times
        batches = list(recording.batches())
    assert any(isinstance(batch, ImuBatch) for batch in batches)
    times = joined([batch for batch in batches if isinstance(batch, LidarBatch)], "times")
    last_firing = 11 * 110.592e-6 + 55.296e-6 + 15 * 2.304e-6
    last = times[-1] + (recording.start_ns - START_NS) * 1e-9
    assert last == pytest.approx(computers[-1] + last_firing, abs=2e-4)


def test_a_capture_and_the_bag_of_an_imu_are_one_recording(tmp_path, packets, ros):
    turns = packets.vlp16_turns(0.5, first_us=START_US)
    capture = packets.write_datagrams(tmp_path / "a.pcap", captured(turns))
    entries = [("/imu", t, ros.imu(t)) for t in np.arange(0, 0.5, 0.01)]
    bag = ros.write(tmp_path / "a.bag", entries)
    with Recording([capture, bag], Payload(T_imu_lidar={})) as recording:
        batches = list(recording.batches())
    imu = [batch for batch in batches if isinstance(batch, ImuBatch)]
    lidar = [batch for batch in batches if isinstance(batch, LidarBatch)]
    assert len(joined(imu, "times")) == 50
    assert recording.counts["lidar.packets"] == len(turns)
    assert joined(lidar, "times")[0] == pytest.approx(DELAY_NS * 1e-9, abs=1e-5)
    assert "put at the computer's time and kept there" in recording.point_times


@pytest.mark.parametrize("stamped", [True, False])
def test_packets_in_a_bag_are_those_of_a_capture(tmp_path, packets, ros, stamped):
    turns = packets.vlp16_turns(0.5, first_us=START_US)
    entries = []
    for begin in range(0, len(turns), 76):
        part = turns[begin : begin + 76]
        rows = [(t_us * 1e-6 + 0.0014 if stamped else None, data) for t_us, data in part]
        t = part[-1][0] * 1e-6 + 0.0014
        entries.append(("/velodyne_packets", t, ros.velodyne_scan(t, rows)))
    bag = ros.write(tmp_path / "a.bag", entries)
    lidar, recording = read(bag)
    reference, _ = read(packets.write_datagrams(tmp_path / "a.pcap", captured(turns)))
    assert recording.lidar_type == "velodyne_msgs/msg/VelodyneScan"
    assert recording.counts["lidar.packets"] == len(turns)
    np.testing.assert_array_equal(joined(lidar, "points"), joined(reference, "points"))
    np.testing.assert_allclose(joined(lidar, "times"), joined(reference, "times"), atol=2e-8)


def test_a_bag_with_clouds_too_is_read_from_the_clouds(tmp_path, packets, ros1):
    table = np.zeros(4, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("t", "u4")])
    table["x"], table["t"] = 5.0, [0, 10**7, 5 * 10**7, 9 * 10**7]
    rows = [(0.0, data) for _, data in packets.vlp16_turns(0.01)]
    entries = [
        ("/velodyne_packets", 0.0, ros1.velodyne_scan(0.0, rows)),
        *(("/velodyne_points", t, ros1.cloud(t, table)) for t in (0.0, 0.1)),
    ]
    with Recording(ros1.write(tmp_path / "a.bag", entries)) as recording:
        assert recording.lidar_topic == "/velodyne_points"


def test_two_lidars_in_one_capture_are_told_apart_by_their_address(tmp_path, packets):
    frames = [
        (START_NS + t_us * 1000, packets.ethernet(packets.udp(packet, source=source)[0]))
        for t_us, packet in packets.vlp16_turns(0.2, first_us=START_US)
        for source in ("10.0.0.1", "10.0.0.2")
    ]
    path = packets.write_pcap(tmp_path / "a.pcap", frames)
    with pytest.raises(RecordingError, match=r"2 topics could be the lidar: 10\.0\.0\.1:2368"):
        Recording(path)
    _, recording = read(path, Payload(lidar={"topic": "10.0.0.2:2368"}))
    assert recording.counts["lidar.packets"] * 2 == len(frames)


def test_damaged_packets_are_left_out_and_counted(tmp_path, packets):
    capture = captured(packets.vlp16_turns(0.5, first_us=START_US))
    capture[100] = (capture[100][0], capture[100][1][:-1] + b"\x28")
    capture[200] = (capture[200][0], capture[200][1][:1200] + b"\xff" * 4 + b"\x37\x22")
    _, recording = read(packets.write_datagrams(tmp_path / "a.pcap", capture))
    assert recording.counts["lidar.broken_packets"] == 2
    assert recording.counts["lidar.packets"] == len(capture) - 2
    assert "2 packets are none of this sensor's" in recording.warnings[0]


def test_packets_that_come_twice_are_used_once(tmp_path, packets):
    turns = packets.vlp16_turns(0.2, first_us=START_US)
    twice = [item for item in captured(turns) for _ in range(2)]
    _, recording = read(packets.write_datagrams(tmp_path / "a.pcap", twice))
    assert recording.counts["lidar.duplicate_stamps"] == recording.counts["lidar.packets"]


@pytest.mark.parametrize(
    ("number", "told", "sentence"),
    [
        (0x23, None, "0x23 .vlp32a or vlp32b.; say which.*lidar: {model"),
        (0x00, None, "0x00 .unknown.; say which"),
        (0x31, None, "0x31 .unknown.; say which"),
        (0x28, "vlp16", "0x28 .vlp32c., but the payload says 'model: vlp16'; remove it"),
    ],
)
def test_a_model_that_is_in_doubt_is_asked_for(tmp_path, packets, number, told, sentence):
    capture = captured(packets.vlp16_turns(0.05, first_us=START_US, number=number))
    path = packets.write_datagrams(tmp_path / "a.pcap", capture)
    with pytest.raises(RecordingError, match=sentence):
        Recording(path, Payload(lidar={"model": told}))


@pytest.mark.parametrize(("number", "told"), [(0x23, "vlp32a"), (0x00, "hdl32e"), (0x22, "vlp16")])
def test_the_payload_names_the_model_where_packets_do_not(tmp_path, packets, number, told):
    """Firmware of the HDL-32E before 2016 leaves the number at zero."""
    capture = captured(packets.vlp16_turns(0.2, first_us=START_US, number=number))
    path = packets.write_datagrams(tmp_path / "a.pcap", capture)
    lidar, recording = read(path, Payload(lidar={"model": told}))
    assert recording.counts["lidar.packets"] == len(capture)
    assert len(np.unique(joined(lidar, "ring"))) == (16 if told == "vlp16" else 32)


def test_an_hdl64_is_refused_because_its_calibration_is_not_known(tmp_path, packets):
    def lower(packet):
        return b"".join(
            (b"\xff\xdd" if i % 2 else b"\xff\xee") + packet[100 * i + 2 : 100 * i + 100]
            for i in range(12)
        ) + packet[1200:]  # fmt: skip

    turns = [(t, lower(packet)) for t, packet in packets.vlp16_turns(0.05)]
    path = packets.write_datagrams(tmp_path / "a.pcap", captured(turns))
    with pytest.raises(RecordingError, match=r"HDL-64E.*calibration"):
        Recording(path)


def test_without_the_library_one_sentence_says_what_to_install(wall_capture, monkeypatch):
    monkeypatch.setitem(sys.modules, "velodyne_decoder", None)
    with pytest.raises(RecordingError, match=r'pip install "bentwing\[packets\]"') as raised:
        Recording(wall_capture)
    assert "\n" not in str(raised.value)


def test_a_part_of_a_capture_is_read(tmp_path, packets):
    capture = captured(packets.vlp16_turns(1.0, first_us=START_US))
    path = packets.write_datagrams(tmp_path / "a.pcap", capture)
    with Recording(path) as recording:
        whole = joined(list(recording.batches()), "times")
        part = joined(list(recording.batches(0.3, 0.4)), "times")
    np.testing.assert_array_equal(part, whole[(whole >= 0.3) & (whole < 0.7)])


def test_the_points_are_the_same_however_packets_are_grouped(packets):
    import velodyne_decoder

    from bentwing.recording.packets.velodyne import VelodynePackets

    turns = packets.vlp16_turns(0.05)
    data, times = [p for _, p in turns], np.array([t * 1e-6 for t, _ in turns])

    def decoded(size):
        decoder = VelodynePackets(velodyne_decoder, "vlp16", 0x22)
        groups = [slice(i, i + size) for i in range(0, len(data), size)]
        return [decoder.points(data[group], times[group], Counter()) for group in groups]

    one, all_ = decoded(1), decoded(len(data))
    np.testing.assert_array_equal(joined(one, "points"), joined(all_, "points"))
    np.testing.assert_allclose(joined(one, "times"), joined(all_, "times"), atol=1e-8)
