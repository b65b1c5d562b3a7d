# SPDX-License-Identifier: MIT OR Apache-2.0
"""The folder a simulation leaves, read back with an independent reader."""

import numpy as np
import pytest
import yaml
from pydantic import ValidationError
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from typer import Typer
from typer.testing import CliRunner

from bentwing.base.errors import UsageError
from bentwing.cli.simulate import command
from bentwing.simulate import Scenario, simulate

ROS2 = get_typestore(Stores.ROS2_HUMBLE)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    scenario = Scenario(scene="office", head="hokuyo-nod", duration=11.0)
    return simulate(scenario, tmp_path_factory.mktemp("simulated") / "out")


def counts(path):
    with AnyReader([path], default_typestore=ROS2) as reader:
        return {topic: info.msgcount for topic, info in reader.topics.items()}


def test_a_bag_holds_every_scan_and_every_inertial_sample(files):
    assert counts(files.recording) == {"/scan": 1100, "/imu": 2200}


def test_scans_are_as_the_hokuyo_driver_publishes_them(files):
    with AnyReader([files.recording]) as reader:
        scans = (c for c in reader.connections if c.topic == "/scan")
        connection, arrival_ns, raw = next(reader.messages(connections=list(scans)))
        scan = reader.deserialize(raw, connection.msgtype)
    assert len(scan.ranges) == 416
    assert np.degrees(scan.angle_min) == pytest.approx(-135.0, abs=1e-4)
    assert scan.time_increment * 360 / 0.65 == pytest.approx(0.01)
    stamp_ns = scan.header.stamp.sec * 10**9 + scan.header.stamp.nanosec
    assert 0.005e9 < arrival_ns - stamp_ns < 0.03e9
    finite = scan.ranges[np.isfinite(scan.ranges)]
    assert 0.05 < finite.min() < finite.max() < 30.0


def test_the_true_trajectory_has_a_pose_for_every_inertial_sample(files):
    lines = files.trajectory.read_text().splitlines()
    assert len(lines) == 2200
    assert lines[1].startswith("1704067200.005000000 ")
    quats = np.array([[float(v) for v in line.split()[4:]] for line in lines])
    np.testing.assert_allclose(np.linalg.norm(quats, axis=1), 1.0, atol=1e-8)


def test_payload_is_nominal_and_calibration_is_true(files):
    payload = yaml.safe_load(files.payload.read_text())
    truth = yaml.safe_load(files.calibration.read_text())
    assert payload["lidar"]["kind"] == "hokuyo-utm30lx"
    nominal, true = (np.array(f["T_imu_lidar"]["translation"]) for f in (payload, truth))
    assert 1e-3 < np.linalg.norm(nominal - true) < 8e-3
    assert 1e-3 <= abs(truth["latency"]) <= 4e-3


def test_the_scenario_can_be_run_again_from_its_file(files):
    again = Scenario.model_validate(yaml.safe_load(files.scenario.read_text()))
    assert again == Scenario(scene="office", head="hokuyo-nod", duration=11.0)


def test_an_existing_recording_is_not_overwritten(files):
    with pytest.raises(UsageError, match="exists already"):
        simulate(Scenario(scene="office"), files.recording.parent)


@pytest.mark.parametrize("kind", ["mcap", "db3"])
def test_ros2_recordings_hold_the_same_messages(kind, tmp_path):
    scenario = Scenario(scene="office", head="hokuyo-nod", duration=10.5, format=kind)
    assert counts(simulate(scenario, tmp_path).recording) == {"/scan": 1050, "/imu": 2100}


def test_unknown_names_and_impossible_durations_are_refused():
    with pytest.raises(ValidationError, match="scene"):
        Scenario(scene="moon")
    with pytest.raises(ValidationError, match="event"):
        Scenario(scene="office", events=("earthquake",))


def test_a_flight_too_short_to_land_is_refused(tmp_path):
    with pytest.raises(UsageError, match=r"takes at least \d+ s, 9 s"):
        simulate(Scenario(scene="office", duration=9.0), tmp_path)


def test_the_command_names_what_it_wrote(tmp_path):
    app = Typer()
    app.command()(command)
    arguments = ["office", "-o", str(tmp_path / "out"), "--head", "hokuyo-nod", "--duration", "10"]
    result = CliRunner().invoke(app, [*arguments, "--event", "gap"], catch_exceptions=False)
    assert result.exit_code == 0
    assert str(tmp_path / "out" / "recording.bag") in result.stdout
    assert counts(tmp_path / "out" / "recording.bag")["/imu"] == 2000 - 300
