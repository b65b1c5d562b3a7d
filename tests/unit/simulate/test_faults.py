# SPDX-License-Identifier: MIT OR Apache-2.0
"""Every fault changes what it says of a recording, and nothing else."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from typing import get_args

import numpy as np
import pytest
import yaml
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Reader, Writer
from rosbags.typesys import Stores, get_typestore

from bentwing.base import geometry
from bentwing.base.errors import UsageError
from bentwing.simulate import Scenario, simulate
from bentwing.simulate.faults import messages
from bentwing.simulate.faults.registry import FAULTS, fault_of
from bentwing.simulate.faults.rewrite import with_fault
from bentwing.simulate.faults.simulation import simulate_with_fault
from bentwing.simulate.names import FaultName

ROS1 = get_typestore(Stores.ROS1_NOETIC)
HEADS = ("hokuyo-spin", "vlp16-fixed", "vlp16-motor")
DURATION = 0.8
MOUNTS = [name for name in FAULTS if name.startswith("mount")]
ROLES = {
    messages.IMU: "imu",
    messages.ENCODER: "encoder",
    messages.SCAN: "lidar",
    messages.CLOUD: "lidar",
}


@dataclass
class Read:
    """What a recording holds: by role the messages, the raw bytes and the recorder's times."""

    parsed: dict[str, list]
    raw: dict[str, list[bytes]]
    arrivals: dict[str, list[int]]

    def each(self, role, value):
        return np.array([value(message) for message in self.parsed[role]])

    @property
    def gyro(self):
        return self.each("imu", messages.gyro)

    @property
    def accel(self):
        return self.each("imu", messages.accel)

    @property
    def angles(self):
        return self.each("encoder", lambda message: message.position[-1])

    def stamps(self, role):
        return self.each(role, messages.stamp_ns)

    @property
    def points(self):
        return np.concatenate([points_of(message) for message in self.parsed["lidar"]])


def points_of(message):
    if not messages.is_scan(message):
        return messages.positions(message)
    angles = message.angle_min + message.angle_increment * np.arange(len(message.ranges))
    fan = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    returned = np.isfinite(message.ranges)
    return message.ranges[returned, None] * fan[returned]


def read(path):
    parsed, raw, arrivals = ({role: [] for role in ROLES.values()} for _ in range(3))
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, stamp, data in reader.messages():
            role = ROLES[connection.msgtype]
            parsed[role].append(reader.deserialize(data, connection.msgtype))
            raw[role].append(bytes(data))
            arrivals[role].append(stamp)
    return Read(parsed, raw, arrivals)


@pytest.fixture(scope="session")
def good(tmp_path_factory):
    """Files and contents of a short recording of each head, on a stand or walked with."""
    made = {}

    def of(head):
        if head not in made:
            folder = tmp_path_factory.mktemp(head)
            flight = {"flight": "tour", "duration": 10.5} if head == "hokuyo-nod" else {}
            chosen = {"flight": "stand", "duration": DURATION, "seed": 3, **flight}
            files = simulate(Scenario(scene="office", head=head, **chosen), folder / "good")
            made[head] = files, read(files.recording), yaml.safe_load(files.payload.read_text())
        return made[head]

    return of


@pytest.fixture
def faulty(good, tmp_path):
    def of(name, head=None):
        head = head or next(head for head in HEADS if head in FAULTS[name].heads)
        files, before, described = good(head)
        recording, payload = with_fault(files.recording, files.payload, name, tmp_path / "bad")
        return before, read(recording), described, yaml.safe_load(payload.read_text())

    return of


def test_faults_are_named_as_the_command_line_has_them():
    assert sorted(FAULTS) == sorted(get_args(FaultName))


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_a_fault_says_in_a_sentence_what_it_does(fault):
    assert re.fullmatch(r"[A-Z].*\.", fault.does)
    assert re.compile(fault.cause, re.IGNORECASE)
    assert fault.heads


CASES = [(name, head) for name in FAULTS for head in HEADS if head in FAULTS[name].heads]


@pytest.mark.parametrize(("name", "head"), CASES)
def test_a_fault_changes_what_it_says_and_leaves_the_bytes_of_all_else(
    name, head, faulty, monkeypatch
):
    seen = {}
    change = FAULTS[name].change

    def noted(subject):
        seen["changes"] = change(subject)
        return seen["changes"]

    noted_fault = type(FAULTS[name])(
        **{f.name: getattr(FAULTS[name], f.name) for f in fields(FAULTS[name])} | {"change": noted}
    )
    monkeypatch.setitem(FAULTS, name, noted_fault)
    before, after, described, payload = faulty(name, head)
    changes = seen["changes"]
    touched = {role for role in ROLES.values() if before.raw[role] != after.raw[role]}
    present = {role for role in ROLES.values() if before.raw[role]}
    told = {role for role in ROLES.values() if getattr(changes, role) is not None}
    assert touched == told & present
    assert (payload != described) == (changes.payload is not None)
    for role in present - touched:
        assert after.arrivals[role] == before.arrivals[role]


@pytest.mark.parametrize("name", MOUNTS)
@pytest.mark.parametrize("head", ["vlp16-fixed", "vlp16-motor"])
def test_a_wrong_mount_is_turned_by_what_it_says(name, head, faulty):
    _, _, described, payload = faulty(name, head)

    def pose(content):
        return content["encoder"]["T_imu_motor"] if "encoder" in content else content["T_imu_lidar"]

    before, after = (np.array(pose(content)["quaternion"]) for content in (described, payload))
    turn = geometry.log(geometry.multiply(after, geometry.inverse(before)))
    angle = np.degrees(np.linalg.norm(turn))
    if name == "mount-wxyz":
        np.testing.assert_allclose(after, np.roll(before, 1))
    elif name == "mount-tilted":
        assert 20.0 <= angle <= 30.0
    elif name == "mount-random":
        assert angle > 1.0
    else:
        _, expected, axis = name.split("-")
        assert angle == pytest.approx(float(expected), abs=1e-6)
        assert abs(turn["xyz".index(axis)]) == pytest.approx(np.radians(angle), abs=1e-9)
    assert pose(payload)["translation"] == pose(described)["translation"]


SWAP, CYCLE = [1, 0, 2], [1, 2, 0]
IMU_VALUES = {
    "gyro-swapped": (lambda w: w[:, SWAP], None),
    "gyro-cyclic": (lambda w: w[:, CYCLE], None),
    "gyro-negated": (lambda w: -w, None),
    "gyro-zero": (lambda w: 0 * w, None),
    "gyro-constant": (lambda w: np.tile(w[0], (len(w), 1)), None),
    "gyro-saturated": (lambda w: w.clip(-0.4 * abs(w).max(), 0.4 * abs(w).max()), None),
    "gyro-1.2": (lambda w: 1.2 * w, None),
    "gyro-2": (lambda w: 2 * w, None),
    "gyro-degrees": (np.degrees, None),
    "accel-swapped": (None, lambda a: a[:, SWAP]),
    "accel-cyclic": (None, lambda a: a[:, CYCLE]),
    "accel-negated": (None, lambda a: -a),
    "accel-g": (None, lambda a: a / 9.80665),
    "accel-milli-g": (None, lambda a: 1000 * a / 9.80665),
    "imu-cyclic": (lambda w: w[:, CYCLE], lambda a: a[:, CYCLE]),
    "imu-left-handed": (lambda w: w[:, SWAP], lambda a: a[:, SWAP]),
}


@pytest.mark.parametrize("name", IMU_VALUES)
def test_inertial_values_are_what_the_fault_makes_of_them(name, faulty):
    before, after, *_ = faulty(name)
    on_gyro, on_accel = IMU_VALUES[name]
    np.testing.assert_allclose(after.gyro, on_gyro(before.gyro) if on_gyro else before.gyro)
    np.testing.assert_allclose(after.accel, on_accel(before.accel) if on_accel else before.accel)
    np.testing.assert_array_equal(after.stamps("imu"), before.stamps("imu"))


@pytest.mark.parametrize("sensor", ["gyro", "accel"])
def test_one_negated_axis_leaves_the_other_two(sensor, faulty):
    before, after, *_ = faulty(f"{sensor}-one-negated")
    old, new = getattr(before, sensor), getattr(after, sensor)
    same = (old == new).all(axis=0)
    assert same.sum() == 2
    np.testing.assert_array_equal(new[:, ~same], -old[:, ~same])


def test_a_frozen_imu_repeats_a_sample_from_half_way_on(faulty):
    before, after, *_ = faulty("imu-frozen")
    changed = np.flatnonzero((before.gyro != after.gyro).any(axis=1))
    assert changed[0] == pytest.approx(len(before.gyro) / 2, abs=5)
    assert len(np.unique(after.accel[changed], axis=0)) == 1
    np.testing.assert_array_equal(after.stamps("imu"), before.stamps("imu"))


def test_a_slow_imu_sends_every_twentieth_sample(faulty):
    before, after, *_ = faulty("imu-10hz")
    np.testing.assert_array_equal(after.stamps("imu"), before.stamps("imu")[::20])
    np.testing.assert_array_equal(after.gyro, before.gyro[::20])


def test_the_imu_of_another_flight_is_at_rest_first_and_moves_otherwise(faulty):
    before, after, *_ = faulty("imu-of-another", "hokuyo-nod")
    np.testing.assert_array_equal(after.stamps("imu"), before.stamps("imu"))
    at_rest = slice(0, 400)
    assert np.linalg.norm(after.accel[at_rest], axis=1).mean() == pytest.approx(9.8, abs=0.2)
    moving = slice(1200, 1800)
    assert after.gyro[moving].std() > 0.3
    assert (after.gyro - before.gyro)[moving].std() > 0.3


def test_without_gravity_a_head_at_rest_feels_its_biases_alone(faulty):
    before, after, *_ = faulty("accel-no-gravity", "vlp16-fixed")
    assert np.linalg.norm(before.accel.mean(axis=0)) == pytest.approx(9.8, abs=0.15)
    assert np.linalg.norm(after.accel.mean(axis=0)) < 0.15
    np.testing.assert_array_equal(after.gyro, before.gyro)


def test_in_an_elevator_a_level_head_feels_the_start_and_the_stop(faulty):
    before, after, *_ = faulty("elevator", "hokuyo-nod")
    pushed = np.linalg.norm(after.accel - before.accel, axis=1)
    assert pushed.max() == pytest.approx(1.2, abs=0.01)
    assert (pushed > 0).sum() / 200 == pytest.approx(3.67, abs=0.1)  # one overlaps the other
    speed = (np.linalg.norm(after.accel, axis=1) - np.linalg.norm(before.accel, axis=1)).sum() / 200
    assert abs(speed) < 0.3


@pytest.mark.parametrize("name", [name for name in FAULTS if re.search(r"-(late|early)-\d", name)])
def test_the_lidars_stamps_are_off_by_what_the_fault_says(name, faulty):
    before, after, *_ = faulty(name, "vlp16-motor")
    _, way, seconds = name.split("-")
    shift = round(float(seconds) * 1e9) * (1 if way == "late" else -1)
    for role in ("lidar", "encoder"):
        assert set(after.stamps(role) - before.stamps(role)) == {shift}
        assert after.arrivals[role] == before.arrivals[role]
    np.testing.assert_array_equal(after.points, before.points)


@pytest.mark.parametrize("sensor", ["lidar", "imu"])
def test_a_clock_since_power_on_counts_on_from_47_seconds(sensor, faulty):
    before, after, *_ = faulty(f"{sensor}-power-on")
    assert after.stamps(sensor)[0] == pytest.approx(47e9, abs=0.2e9)
    np.testing.assert_array_equal(np.diff(after.stamps(sensor)), np.diff(before.stamps(sensor)))


def test_a_drifting_clock_is_one_percent_fast(faulty):
    before, after, *_ = faulty("lidar-drifting")
    old, new = before.stamps("lidar"), after.stamps("lidar")
    assert np.ptp(new) / np.ptp(old) == pytest.approx(1.01, rel=1e-6)
    assert abs(new[0] - old[0]) < 1e6


POINTS = {
    "lidar-mirrored": lambda points: points * [1, -1, 1],
    "lidar-upside-down": lambda points: points * [1, -1, -1],
    "ranges-1.3": lambda points: 1.3 * points,
    "ranges-millimetres": lambda points: 1000 * points,
    "ranges-constant": lambda points: 5 * points / np.linalg.norm(points, axis=1)[:, None],
}


@pytest.mark.parametrize(
    ("name", "head"),
    [(name, head) for name in POINTS for head in HEADS[:2] if (name, head) in CASES],
)
def test_points_are_what_the_fault_makes_of_them(name, head, faulty):
    before, after, *_ = faulty(name, head)
    expected = POINTS[name](before.points)
    if name == "ranges-constant" and head == "hokuyo-spin":  # beams without a return have one too
        assert np.allclose(np.linalg.norm(after.points, axis=1), 5.0)
    else:
        scale = np.linalg.norm(expected, axis=1).max()
        np.testing.assert_allclose(after.points, expected, atol=1e-6 * scale)
    np.testing.assert_array_equal(after.stamps("lidar"), before.stamps("lidar"))


def test_a_mirrored_scan_keeps_its_beams_and_their_times(faulty):
    before, after, *_ = faulty("lidar-mirrored", "hokuyo-spin")
    old, new = before.parsed["lidar"][5], after.parsed["lidar"][5]
    np.testing.assert_array_equal(new.ranges, old.ranges)
    assert new.time_increment == old.time_increment
    assert new.angle_min == -old.angle_min


def test_limits_of_a_scan_in_millimetres_are_in_millimetres(faulty):
    before, after, *_ = faulty("ranges-millimetres", "hokuyo-spin")
    old, new = before.parsed["lidar"][0], after.parsed["lidar"][0]
    assert new.range_max == pytest.approx(1000 * old.range_max)
    assert new.range_min == pytest.approx(1000 * old.range_min)


@pytest.mark.parametrize("head", ["hokuyo-spin", "vlp16-fixed"])
def test_random_ranges_have_nothing_of_the_true_ones(head, faulty):
    before, after, *_ = faulty("ranges-random", head)
    ranges = np.linalg.norm(after.points, axis=1)
    assert 0.5 <= ranges.min() < 0.6
    assert 19.9 < ranges.max() <= 20.0
    if head == "vlp16-fixed":
        true = np.linalg.norm(before.points, axis=1)
        assert abs(np.corrcoef(true, ranges)[0, 1]) < 0.05


def test_shuffled_points_are_the_same_points_at_other_times(faulty):
    before, after, *_ = faulty("points-shuffled")
    old, new = (messages.table(one.parsed["lidar"][0]) for one in (before, after))
    np.testing.assert_array_equal(new["time"], old["time"])
    np.testing.assert_array_equal(np.sort(new["x"]), np.sort(old["x"]))
    assert (new["x"] == old["x"]).mean() < 0.05


@pytest.mark.parametrize("name", ["times-none", "times-none-end"])
def test_clouds_without_times_are_those_points_and_may_be_stamped_at_their_end(name, faulty):
    before, after, *_ = faulty(name, "vlp16-fixed")
    old, new = (messages.table(one.parsed["lidar"][3]) for one in (before, after))
    assert new.dtype.names == ("x", "y", "z", "intensity", "ring")
    for field in new.dtype.names:
        np.testing.assert_array_equal(new[field], old[field])
    late = 1e-9 * (after.stamps("lidar")[3] - before.stamps("lidar")[3])
    assert late == pytest.approx(old["time"].max() if name.endswith("end") else 0.0, abs=1e-6)


@pytest.mark.parametrize("name", ["times-none", "times-none-end"])
def test_scans_without_times_say_neither_increment_nor_length(name, faulty):
    before, after, *_ = faulty(name, "hokuyo-spin")
    old, new = (one.parsed["lidar"][3] for one in (before, after))
    assert (new.time_increment, new.scan_time) == (0.0, 0.0)
    np.testing.assert_array_equal(new.ranges, old.ranges)
    late = 1e-9 * (after.stamps("lidar")[3] - before.stamps("lidar")[3])
    length = old.time_increment * (len(old.ranges) - 1)
    assert late == pytest.approx(length if name.endswith("end") else 0.0, abs=1e-6)


def test_a_level_lidar_sees_one_ring_at_the_times_of_its_points(faulty):
    before, after, _, payload = faulty("lidar-level")
    assert payload["lidar"]["kind"] == "generic"
    cloud, scan = before.parsed["lidar"][0], after.parsed["lidar"][0]
    rows = messages.table(cloud)
    ring = rows[rows["ring"] == 7] if (rows["ring"] == 7).sum() else rows[rows["ring"] == 8]
    beams = np.flatnonzero(np.isfinite(scan.ranges))
    assert len(beams) == pytest.approx(len(ring), rel=0.02)
    angles = scan.angle_min + scan.angle_increment * beams
    found = np.interp(
        beams * scan.time_increment,
        ring["time"] - ring["time"].min(),
        np.unwrap(np.arctan2(ring["y"], ring["x"])),
    )
    off = np.angle(np.exp(1j * (found - angles)))
    assert abs(off).max() < 2 * abs(scan.angle_increment)


ANGLES = {
    "encoder-degrees": np.degrees,
    "encoder-negated": np.negative,
    "encoder-turned": lambda angles: angles + 0.5,
    "encoder-late": lambda angles: angles,
    "encoder-second": lambda angles: angles,
}


@pytest.mark.parametrize("name", ANGLES)
def test_encoder_angles_are_what_the_fault_makes_of_them(name, faulty):
    before, after, *_ = faulty(name)
    np.testing.assert_allclose(after.angles, ANGLES[name](before.angles))
    late = 20_000_000 if name == "encoder-late" else 0
    assert set(after.stamps("encoder") - before.stamps("encoder")) == {late}
    n_joints = 2 if name == "encoder-second" else 1
    assert {len(message.name) for message in after.parsed["encoder"]} == {n_joints}


def test_the_wrong_axis_is_at_right_angles_to_the_motors(faulty):
    _, _, described, payload = faulty("encoder-axis")
    assert np.dot(payload["encoder"]["axis"], described["encoder"]["axis"]) == 0.0


def test_the_truth_goes_along_and_names_the_fault(good, tmp_path):
    files, *_ = good("vlp16-fixed")
    with_fault(files.recording, files.payload, "gyro-zero", tmp_path)
    truth = yaml.safe_load((tmp_path / "truth_calibration.yaml").read_text())
    assert truth.pop("fault") == "gyro-zero"
    assert truth == yaml.safe_load(files.calibration.read_text())
    for path in (files.trajectory, files.scene, files.scenario):
        assert (tmp_path / path.name).read_bytes() == path.read_bytes()


def test_what_a_fault_draws_depends_on_the_seed_alone(good, tmp_path):
    files, *_ = good("vlp16-fixed")
    texts = [
        with_fault(files.recording, files.payload, "mount-random", tmp_path / str(i), seed=seed)[
            1
        ].read_text()
        for i, seed in enumerate((1, 1, 2))
    ]
    assert texts[0] == texts[1] != texts[2]


@pytest.mark.parametrize("kind", ["mcap", "db3"])
def test_a_ros2_recording_keeps_its_format(kind, tmp_path):
    scenario = Scenario(
        scene="office", head="vlp16-fixed", flight="stand", duration=0.4, format=kind
    )
    files = simulate_with_fault(scenario, "lidar-level", tmp_path)
    assert list(files.recording.glob(f"*.{kind}"))
    after = read(files.recording)
    assert len(after.raw["imu"]) == 80
    assert all(messages.is_scan(message) for message in after.parsed["lidar"])


@pytest.mark.parametrize(
    ("name", "head", "sentence"),
    [
        ("encoder-late", "vlp16-fixed", "the recording has no encoder"),
        ("encoder-axis", "vlp16-fixed", "no motor's axis"),
        ("points-shuffled", "hokuyo-spin", "needs the points of a 3D lidar"),
        ("mount-upwards", "vlp16-fixed", "no fault is called mount-upwards"),
    ],
)
def test_a_fault_that_does_not_fit_is_refused(name, head, sentence, good, tmp_path):
    files, *_ = good(head)
    with pytest.raises(UsageError, match=sentence):
        with_fault(files.recording, files.payload, name, tmp_path)


def test_a_bag_without_an_imu_has_no_gyro_to_fail(good, tmp_path):
    files, *_ = good("vlp16-fixed")
    alone = tmp_path / "recording.bag"
    with Reader(files.recording) as reader, Writer(alone) as writer:
        for connection, stamp, raw in reader.messages():
            if connection.msgtype == messages.CLOUD:
                key = connection.topic, connection.msgtype
                known = {(c.topic, c.msgtype): c for c in writer.connections}
                new = known.get(key) or writer.add_connection(*key, typestore=ROS1)
                writer.write(new, stamp, raw)
    (tmp_path / "payload.yaml").write_text("name: alone")
    for name in ("gyro-zero", "gyro-saturated", "mount-90-x"):
        with pytest.raises(UsageError, match=r"no (IMU|T_imu_lidar)"):
            with_fault(alone, tmp_path / "payload.yaml", name, tmp_path / name)
    recording, _ = with_fault(alone, tmp_path / "payload.yaml", "lidar-mirrored", tmp_path / "ok")
    assert read(recording).raw["lidar"]


def test_a_head_without_a_motor_has_no_encoder_to_fail():
    with pytest.raises(UsageError, match="cannot be put into hokuyo-spin; it can into vlp16-motor"):
        fault_of("encoder-late", "hokuyo-spin")


def test_a_fault_that_needs_the_truth_says_so(good, tmp_path):
    files, *_ = good("vlp16-fixed")
    alone = tmp_path / "recording.bag"
    alone.write_bytes(files.recording.read_bytes())
    for name in ("elevator", "imu-of-another"):
        with pytest.raises(UsageError, match="needs a simulated recording"):
            with_fault(alone, files.payload, name, tmp_path / name)


def test_no_recording_is_written_over(good, tmp_path):
    files, *_ = good("vlp16-fixed")
    with_fault(files.recording, files.payload, "gyro-zero", tmp_path)
    with pytest.raises(UsageError, match="exists already"):
        with_fault(files.recording, files.payload, "gyro-2", tmp_path)
