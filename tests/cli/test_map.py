# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing map` as a user runs it: what comes out, and what is said when nothing can."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from rosbags.rosbag1 import Writer

from bentwing.base.trajectory import read_tum
from bentwing.map.read import read_points

BENTWING = "from bentwing.cli.main import run; run()"
SHORT = ("--duration", "9", "--map-spacing", "0.05")


def record_of(out):
    return json.loads((out / "run.json").read_text())


@pytest.fixture(scope="module")
def mapped(office, tmp_path_factory):
    """The whole office, mapped in a process of its own."""
    out = tmp_path_factory.mktemp("mapped") / "run"
    command = [office / "recording.bag", "--payload", office / "payload.yaml", "-o", out]
    done = subprocess.run(
        [sys.executable, "-c", BENTWING, "map", *map(str, command), "--threads", "1"],
        capture_output=True,
        text=True,
        check=False,
    )
    return done, out


def test_a_flight_becomes_a_run_folder(mapped):
    done, out = mapped
    assert done.returncode == 0, done.stderr
    assert "report.html" in done.stdout + done.stderr
    names = {path.name for path in out.iterdir()}
    assert {"trajectory.txt", "odometry.txt", "map.laz", "report.html", "run.json"} <= names
    assert not [name for name in names if "tmp" in name or "part" in name]


def test_the_record_of_the_run_agrees_with_its_files(mapped, office):
    _, out = mapped
    record = record_of(out)
    assert record["complete"] is True
    assert set(record["files"]) == {path.name for path in out.iterdir()} - {"run.json"}
    counts = record["counts"]
    assert counts["map.written"] == len(read_points(out / "map.laz")) > 100_000
    left_out = counts["map.mixed_pixels"] + counts["map.moving"]
    assert counts["map.points"] - left_out == counts["map.written"]
    trajectory, _ = read_tum(out / "trajectory.txt")
    truth, _ = read_tum(office / "truth_trajectory.txt")
    assert np.ptp(trajectory.times) == pytest.approx(np.ptp(truth.times), abs=0.2)
    assert [entry["name"] for entry in record["inputs"]] == ["recording.bag", "payload.yaml"]
    assert record["peak_memory_mb"] < 1000
    assert 0 < record["timings"]["estimate"] < record["timings"]["total"]


def test_the_start_of_a_good_flight_is_a_note_and_no_warning(mapped):
    done, out = mapped
    record = record_of(out)
    assert record["warnings"] == []
    assert "warning" not in done.stderr
    (note,) = record["notes"]
    assert note.startswith("the head had turned once by ")
    page = (out / "report.html").read_text()
    assert record["verdict"]["state"] == "good"
    assert record["verdict"]["reasons"] == []
    assert "Good: all that was checked agrees" in page
    assert f"{note[0].upper()}{note[1:]}." in page


def test_the_report_stands_alone(mapped):
    page = (mapped[1] / "report.html").read_text()
    assert "<html" in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "<script src" not in page
    assert "<link" not in page


def test_two_threads_write_the_same_bytes_as_one(mapped, office, bentwing, tmp_path):
    command = (
        office / "recording.bag",
        "--payload",
        office / "payload.yaml",
        "-o",
        tmp_path / "run",
    )
    assert bentwing("map", *command, "--threads", "2", "--map-spacing", "1", "--quiet").code == 0
    for name in ("trajectory.txt", "odometry.txt"):
        assert (tmp_path / "run" / name).read_bytes() == (mapped[1] / name).read_bytes()


@pytest.mark.parametrize("kind", ["las", "ply", "pcd"])
def test_every_format_holds_the_counted_points(office, bentwing, tmp_path, kind):
    command = (
        office / "recording.bag",
        "--payload",
        office / "payload.yaml",
        "-o",
        tmp_path / "run",
    )
    result = bentwing("map", *command, "--map-format", kind, *SHORT, "--quiet")
    assert result.code == 0, result.err
    assert (result.out, result.err) == ("", "")
    points = read_points(tmp_path / "run" / f"map.{kind}")
    counts = record_of(tmp_path / "run")["counts"]
    left_out = counts["map.mixed_pixels"] + counts["map.moving"] + counts["map.thinned"]
    assert len(points) == counts["map.written"] == counts["map.points"] - left_out > 1000
    assert np.abs(points).max() < 40.0  # m; the office and no more
    trajectory, _ = read_tum(tmp_path / "run" / "trajectory.txt")
    assert np.ptp(trajectory.times) == pytest.approx(9.0, abs=0.2)


@pytest.mark.parametrize("name", ["kalman", "ndt"])
def test_every_estimator_makes_the_same_files(simulated, bentwing, tmp_path, name):
    yard = simulated("courtyard", 22.0, head="vlp16-fixed")
    command = (yard / "recording.bag", "--payload", yard / "payload.yaml", "-o", tmp_path / "run")
    result = bentwing("map", *command, *SHORT, "--estimator", name, "--quiet")
    assert result.code == 0, result.err
    names = {path.name for path in (tmp_path / "run").iterdir()}
    assert {"trajectory.txt", "odometry.txt", "map.laz", "report.html", "run.json"} <= names
    record = record_of(tmp_path / "run")
    assert record["settings"]["estimator"] == name
    assert record["settings"][name]["scan"] == 0.1
    assert all(w["registration_rmse"] > 0 for w in record["windows"] if w["registered"])
    assert sum(w["registered"] for w in record["windows"]) >= 85
    trajectory, _ = read_tum(tmp_path / "run" / "trajectory.txt")
    assert np.ptp(trajectory.times) == pytest.approx(9.0, abs=0.2)


@pytest.mark.parametrize("name", ["kalman", "ndt"])
def test_a_2d_lidar_is_refused_before_anything_is_read(refuse, tmp_path, name):
    refuse(tmp_path / "none.bag", "single planes", options=("--estimator", name), code=3)
    assert not (tmp_path / "run").exists()


# What cannot be used: one sentence that says what, where and what to do, and exit code 3.


def refused(result, *parts, code=3):
    """Check the exit code and that one line of error says all of `parts`."""
    assert result.code == code, (result.code, result.err)
    lines = [line for line in result.err.splitlines() if line.startswith("bentwing: error:")]
    assert len(lines) == 1, result.err
    assert "this is a bug" not in lines[0]
    for part in parts:
        assert part in lines[0]


@pytest.fixture
def refuse(bentwing, tmp_path, office):
    """Map something that cannot be used; the sentence must hold the parts."""

    def run(recording, *parts, payload=None, options=(), code=3):
        payload = office / "payload.yaml" if payload is None else payload
        command = (recording, "--payload", payload, "-o", tmp_path / "run", *options)
        refused(bentwing("map", *command), *parts, code=code)

    return run


def test_a_recording_that_does_not_exist(refuse, tmp_path):
    refuse(tmp_path / "none.bag", "none.bag", "no such file")


def test_a_payload_that_does_not_exist(refuse, office, tmp_path):
    refuse(office / "recording.bag", "none.yaml", "no such file", payload=tmp_path / "none.yaml")


@pytest.mark.parametrize("content", [b"", b"hello, this is no bag\n" * 99, b"#ROSBAG V2.0\n"])
def test_a_file_that_is_no_bag(refuse, tmp_path, content):
    path = tmp_path / "flight.bag"
    path.write_bytes(content)
    refuse(path, "flight.bag")


def test_a_bag_without_messages(refuse, tmp_path, ros1):
    path = ros1.write(tmp_path / "empty.bag", [("/scan", 0.0, "sensor_msgs/msg/LaserScan")])
    refuse(path)


def test_an_empty_topic(refuse, changed_bag):
    def only_imu(topic, t, message):
        return [(t, message)] if topic == "/imu" else []

    refuse(changed_bag(only_imu, until=2.0), "/scan")


def test_an_imu_that_is_described_but_not_there(refuse, changed_bag):
    def only_scans(topic, t, message):
        return [(t, message)] if topic == "/scan" else []

    refuse(changed_bag(only_scans, until=2.0), "/imu")


def test_a_topic_that_is_not_there(refuse, office, changed_payload):
    payload = changed_payload(lidar={"topic": "/laser", "kind": "hokuyo-utm30lx"})
    refuse(office / "recording.bag", "/laser", "/scan", payload=payload)


def test_messages_of_a_type_nobody_knows(refuse, tmp_path, ros2):
    """A database of ROS 2 may name types that nobody here knows."""
    folder = ros2.write(
        tmp_path / "flight", [("/scan", 0.0, ros2.livox(0.0, [0], [(1, 2, 3)]))], kind="db3"
    )
    metadata = folder / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("livox_ros_driver2", "unknown_driver"))
    for database in folder.glob("*.db3"):
        raw = database.read_bytes()
        database.write_bytes(raw.replace(b"livox_ros_driver2", b"unknown_driver123"))
    refuse(folder, "/scan")


def test_messages_with_an_empty_definition(refuse, tmp_path, ros1):
    """Some tools that rewrite bags leave the definitions out."""
    path = tmp_path / "flight.bag"
    scan = ros1.serialize(ros1.scan(0.0))
    with Writer(path) as writer:
        connection = writer.add_connection(
            "/scan", "sensor_msgs/msg/LaserScan", msgdef=" ", md5sum="0" * 32
        )
        for i in range(40):
            writer.write(connection, 1_700_000_000_000_000_000 + i * 25_000_000, scan)
    refuse(path)


def test_beams_without_time(refuse, changed_bag):
    def timeless(topic, t, message):
        if topic == "/scan":
            message.time_increment = message.angle_increment = 0.0
        return [(t, message)]

    refuse(changed_bag(timeless, until=2.0), "/scan", "no time per beam", "time_increment")


def test_scans_that_see_nothing(refuse, changed_bag):
    def blind(topic, t, message):
        if topic == "/scan":
            message.ranges = np.full_like(message.ranges, np.nan)
        return [(t, message)]

    refuse(changed_bag(blind, until=5.0), "/scan")


@pytest.mark.parametrize(
    ("wrong", "part"),
    [
        ({"translation": [60.0, 0.0, -50.0]}, "metres"),
        ({"quaternion": [1.0, 1.0, 0.0, 0.0]}, "norm"),
        ({"translation": [0.0, float("nan"), 0.0]}, "translation"),
        ({"translation": [0.0, 0.0]}, "translation"),
    ],
)
def test_an_impossible_transform(refuse, office, changed_payload, wrong, part):
    refuse(
        office / "recording.bag", "T_imu_lidar", part, payload=changed_payload(T_imu_lidar=wrong)
    )


def test_an_imu_without_its_place_must_be_placed_where_the_payload_is_to_be_trusted(
    refuse, office, changed_payload
):
    refuse(
        office / "recording.bag",
        "/imu",
        "T_imu_lidar",
        payload=changed_payload(T_imu_lidar=None),
        options=("--trust-payload",),
    )


def test_a_mount_that_lays_the_scan_plane_level_is_doubted(refuse, office, changed_payload):
    # A quarter turn off: the head spins an upright plane, and the payload says it is level.
    level = {"quaternion": [0.0, 0.0, 0.0, 1.0]}
    refuse(
        office / "recording.bag",
        "stays level",
        "correct T_imu_lidar",
        payload=changed_payload(T_imu_lidar=level),
        options=("--trust-payload",),
    )


def test_clocks_that_have_nothing_to_do_with_each_other(refuse, changed_bag, shifted):
    def other_clock(topic, t, message):
        return [(t, shifted(message, 3600.0) if topic == "/imu" else message)]

    refuse(changed_bag(other_clock, until=3.0), "/imu", "/scan", "clock")


def test_too_short_a_part(refuse, office):
    refuse(
        office / "recording.bag",
        "less than 1.5 s",
        "lidar points from 0.0",
        options=("--duration", "0.3"),
        code=4,
    )


def test_a_part_behind_the_end(bentwing, office, tmp_path):
    command = (
        office / "recording.bag",
        "--payload",
        office / "payload.yaml",
        "-o",
        tmp_path / "run",
    )
    result = bentwing("map", *command, "--start", "500")
    assert result.code in {2, 3}
    assert len(result.err.splitlines()) == 1


@pytest.mark.parametrize(
    "options",
    [
        ("--estimator", "slam"),
        ("--map-format", "obj"),
        ("--threads", "0"),
        ("--threads", "many"),
        ("--duration", "-1"),
        ("--no-such-option",),
    ],
)
def test_wrong_use_is_told_before_anything_is_read(refuse, tmp_path, options):
    refuse(tmp_path / "none.bag", options=options, code=2)
    assert not (tmp_path / "run").exists()


def test_a_folder_that_is_no_run_is_left_alone(refuse, office, tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "thesis.tex").write_text("years of work")
    refuse(office / "recording.bag", "run", code=2)
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["thesis.tex"]


# What can be used in part: mapped, with a warning.


@pytest.fixture
def accept(bentwing, tmp_path, office):
    """Map something that is damaged; return the record of the run."""

    def run(recording, *options):
        command = (recording, "--payload", office / "payload.yaml", "-o", tmp_path / "run")
        result = bentwing("map", *command, "--map-spacing", "0.2", *options)
        assert result.code == 0, result.err
        return record_of(tmp_path / "run")

    return run


def test_a_bag_that_was_cut_off_is_mapped_up_to_its_end(accept, office, tmp_path):
    raw = (office / "recording.bag").read_bytes()
    path = tmp_path / "cut.bag"
    path.write_bytes(raw[: len(raw) // 2])
    record = accept(path)
    assert any("cut.bag" in w and "cut off" in w for w in record["warnings"])
    trajectory, _ = read_tum(tmp_path / "run" / "trajectory.txt")
    assert np.ptp(trajectory.times) == pytest.approx(11.0, abs=1.5)


def test_single_stamps_that_go_back_are_left_out(accept, changed_bag, shifted):
    def hiccup(topic, t, message):
        wrong = (topic == "/imu" and 5.0 <= t < 5.02) or (topic == "/scan" and 7.0 <= t < 7.02)
        return [(t, shifted(message, -1.0) if wrong else message)]

    text = "\n".join(accept(changed_bag(hiccup, until=9.0))["warnings"])
    for topic in ("/imu", "/scan"):
        assert f"{topic}: " in text
    assert "stamps going backwards" in text


def test_a_gap_of_thirty_seconds_is_told(bentwing, changed_bag, shifted, office, tmp_path):
    """Nothing is known of such a time: mapped with a warning, or refused, but never in silence."""

    def paused(_, t, message):
        return [(t, message)] if t < 7.0 else [(t + 30.0, shifted(message, 30.0))]

    path = changed_bag(paused, until=12.0)
    result = bentwing("map", path, "--payload", office / "payload.yaml", "-o", tmp_path / "run")
    text = result.err + "\n".join(record_of(tmp_path / "run")["warnings"])
    assert result.code in {0, 3, 4}
    assert "30.0 s" in text
    assert "gap" in text


def test_some_scans_that_see_nothing_are_counted(accept, changed_bag):
    def blinded(topic, t, message):
        if topic == "/scan" and 6.0 < t < 6.5:
            message.ranges = np.full_like(message.ranges, np.nan)
        return [(t, message)]

    assert accept(changed_bag(blinded, until=9.0))["counts"]["lidar.nan"] > 10_000


def test_inertial_values_that_are_not_finite_are_left_out(accept, changed_bag):
    def broken(topic, t, message):
        if topic == "/imu" and 6.0 < t < 6.05:
            message.angular_velocity.x = float("nan")
        return [(t, message)]

    record = accept(changed_bag(broken, until=9.0))
    assert any("/imu" in warning for warning in record["warnings"]) or any(
        key.startswith("imu.") and key != "imu.samples" for key in record["counts"]
    )
