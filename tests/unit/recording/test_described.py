# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import yaml

from bentwing.base.calibration import Calibration
from bentwing.base.mount import FixedMount, MotorErrors, MotorMount, Pose
from bentwing.base.plain import plain
from bentwing.base.range_bias import RangeBias
from bentwing.recording import Payload
from bentwing.recording.described import described_calibration, described_mount

POSE = Pose(np.array([0.03, -0.01, 0.05]), np.array([0.5, -0.5, 0.5, 0.5]))
BEHIND = Pose(np.array([0.0, 0.02, -0.07]), np.array([0.0, 0.6, 0.0, 0.8]))


MOTOR = MotorMount(POSE, np.array([0.0, 0.6, 0.8]), -0.25, BEHIND)
ASKEW = MotorErrors(np.array([1e-3, 0.0]), 1e-3 * np.arange(8.0).reshape(2, 4))


@pytest.mark.parametrize("mount", [FixedMount(POSE), MOTOR, replace(MOTOR, errors=ASKEW)])
def test_a_mount_from_run_json_can_be_pasted_into_a_payload(tmp_path, mount):
    none = np.zeros(3)
    run = json.loads(json.dumps(plain(Calibration(0.004, mount, none, none, none))))
    payload = {"imu": {}, "lidar": {"kind": "vlp16", "latency": run["latency"]}, **run["mount"]}
    path = tmp_path / "payload.yaml"
    path.write_text(yaml.safe_dump(payload))
    described = described_calibration(Payload.load(path))
    assert described.latency == 0.004
    assert described.mount.to_json() == mount.to_json()


def test_without_a_description_lidar_and_imu_coincide():
    mount = described_mount(Payload.default())
    np.testing.assert_array_equal(mount.T_imu_lidar.matrix, np.eye(4))


def test_a_zero_in_degrees_is_refused():
    with pytest.raises(ValueError, match="zero"):
        Payload.model_validate({"encoder": {"zero": 90.0}})


def test_estimators_start_from_the_described_ranges(tmp_path):
    payload = Payload.model_validate({"lidar": {"ranges": {"offset": -0.021, "grazing": 4e-4}}})
    assert described_calibration(payload).ranges == RangeBias(-0.021, 4e-4)
    assert described_calibration(Payload.default()).ranges == RangeBias()
    payload.save(tmp_path / "payload.yaml")
    assert Payload.load(tmp_path / "payload.yaml") == payload


@pytest.mark.parametrize("wrong", [{"offset": 1.5}, {"grazing": 0.2}, {"scale": 1e-3}])
def test_ranges_that_no_lidar_has_are_refused(wrong):
    with pytest.raises(ValueError, match=f"ranges.*{next(iter(wrong))}"):
        Payload.model_validate({"lidar": {"ranges": wrong}})
