# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing calibrate` as a user runs it."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml

from bentwing.base import geometry
from bentwing.cli.calibrate_page import ROWS
from bentwing.recording import Payload
from bentwing.recording.sections.calibration import STD_UNITS
from bentwing.simulate import Scenario, simulate


@pytest.fixture(scope="module")
def stand(made_once):
    """One revolution of a lidar on a stand in an office, both mounts wrong in the payload."""
    scenario = Scenario(
        scene="office", head="vlp16-motor", flight="stand", motor_rate=2.5, duration=4.9, seed=3
    )
    return made_once("calibrate-stand", lambda folder: simulate(scenario, folder))


def tilts(pose, truth):
    """Angles (2,), °, about x and y of the motor by which the lidar is turned against the truth."""
    true = np.array(truth["encoder"]["T_motor_lidar"]["quaternion"])
    apart = geometry.multiply(np.array(pose.quaternion), geometry.inverse(true))
    about = np.array([0.0, 0.0, apart[2], apart[3]])
    about /= np.linalg.norm(about)
    left = geometry.multiply(apart, geometry.inverse(about))
    return np.degrees(geometry.log(left))[:2]


def test_both_angles_are_found_from_one_revolution(bentwing, stand, tmp_path):
    out = tmp_path / "out"
    payload = stand / "payload.yaml"
    said = bentwing("calibrate", stand / "recording.bag", "--payload", payload, "-o", out)
    assert said.code == 0, said.err
    assert "not observable" in said.out
    truth = yaml.safe_load((stand / "truth_calibration.yaml").read_text())
    before, after = Payload.load(payload), Payload.load(out / "payload.yaml")
    assert np.abs(tilts(before.encoder.T_motor_lidar, truth)).max() > 0.05
    assert np.abs(tilts(after.encoder.T_motor_lidar, truth)).max() < 0.02
    std = np.degrees(after.calibration.std["motor_tilt"])
    assert (np.abs(tilts(after.encoder.T_motor_lidar, truth)) < 4 * np.max(std)).all()
    # At one rate nothing is said of the delay, and at rest nothing of the IMU.
    assert after.encoder.delay == 0.0
    assert after.encoder.T_imu_motor == before.encoder.T_imu_motor
    assert len(after.calibration.not_observable) == 3
    record = json.loads((out / "calibration.json").read_text())
    assert record["complete"]
    assert record["files"] == ["payload.yaml", "wall.png"]
    assert record["motor"]["wall_gap_after"] < 0.5 * record["motor"]["wall_gap_before"]
    assert (out / "wall.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("options", "says"),
    [(["--duration", "3"], "whole revolution"), (["--start", "3"], "whole revolution")],
)
def test_less_than_a_revolution_is_refused(bentwing, stand, tmp_path, options, says):
    said = bentwing(
        "calibrate", stand / "recording.bag", "--payload", stand / "payload.yaml",
        "-o", tmp_path / "out", *options,
    )  # fmt: skip
    assert said.code == 4
    assert says in said.err


def test_a_fixed_lidar_at_rest_is_told_to_move(bentwing, stand, tmp_path):
    payload = yaml.safe_load((stand / "payload.yaml").read_text())
    del payload["encoder"]
    payload["T_imu_lidar"] = {"translation": [0.0, 0.0, -0.17]}
    path = tmp_path / "payload.yaml"
    path.write_text(yaml.safe_dump(payload))
    said = bentwing("calibrate", stand / "recording.bag", "--payload", path, "-o", tmp_path / "out")
    assert said.code == 3
    assert "motion" in said.err


@pytest.mark.slow
def test_motion_tells_the_mount_of_the_imu_and_the_latency(bentwing, made_once, tmp_path):
    scenario = Scenario(scene="office", head="vlp16-motor", motor_rate=3.0, duration=24.0, seed=2)
    flight = made_once("calibrate-motion", lambda folder: simulate(scenario, folder))
    out = tmp_path / "out"
    said = bentwing(
        "calibrate", flight / "recording.bag", "--payload", flight / "payload.yaml", "-o", out
    )
    assert said.code == 0, said.err
    truth = yaml.safe_load((flight / "truth_calibration.yaml").read_text())
    found = Payload.load(out / "payload.yaml")
    std = found.calibration.std
    assert abs(found.lidar.latency - truth["latency"]) < 4 * std["latency"][0] < 4e-3
    shift = np.subtract(
        found.encoder.T_imu_motor.translation, truth["encoder"]["T_imu_motor"]["translation"]
    )
    assert (np.abs(shift[:2]) < 4 * np.array(std["extrinsic_translation"][:2])).all()
    assert np.abs(tilts(found.encoder.T_motor_lidar, truth)).max() < 0.05


def test_the_page_has_a_row_for_everything_that_has_a_deviation():
    assert ROWS.keys() == STD_UNITS.keys()
