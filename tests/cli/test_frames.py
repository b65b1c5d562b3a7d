# SPDX-License-Identifier: MIT OR Apache-2.0
"""`info`, `payload init` and `map` of a recording whose /tf_static places the lidar on the IMU."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bentwing.base.progress import as_progress
from bentwing.recording import Payload
from bentwing.run.head import Head
from bentwing.run.settings import RunSettings

MOUNT = (
    ("base_link", "imu", (0.1, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)),
    ("base_link", "sensor", (0.1, 0.0, 0.2), (0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5))),
)
LINE = "T_imu_lidar: {from_tf: {parent: imu, child: sensor}}"


@pytest.fixture(scope="module")
def with_tf(ros, head_entries, tmp_path_factory):
    """A recording whose scans are in the frame `sensor` and whose samples are in the frame `imu`."""
    path = tmp_path_factory.mktemp("frames") / ("head.bag" if ros.ros1 else "head")
    entries = [("/tf_static", 0.0, ros.tf(0.0, *MOUNT)), *head_entries(ros, 3.0)]
    return ros.write(path, entries, kind="mcap")


def test_info_lists_the_mount_with_the_line_for_the_payload(bentwing, with_tf):
    said = bentwing("info", with_tf)
    assert LINE in said.out
    text = " ".join(said.out.split())
    assert "the pose of the lidar (sensor) in the IMU's frame (imu) through base_link" in text
    assert "takes points of the lidar to the IMU" in text
    assert "(0.0000 0.0000 0.2000) m" in text


def test_info_as_json_has_the_mount(bentwing, with_tf):
    found = json.loads(bentwing("info", with_tf, "--json").out)["tf_mount"]
    assert found["line"] == LINE
    assert found["T_imu_lidar"]["translation"] == [0.0, 0.0, 0.2]


def test_the_line_of_info_is_a_payload_that_the_recording_answers(bentwing, with_tf, tmp_path):
    (tmp_path / "head.yaml").write_text(f"lidar: {{topic: /scan}}\n{LINE}\n")
    found = bentwing("info", with_tf, "-p", tmp_path / "head.yaml", "--json")
    assert json.loads(found.out)["tf_mount"]["T_imu_lidar"]["translation"] == [0.0, 0.0, 0.2]
    (tmp_path / "typo.yaml").write_text("T_imu_lidar: {from_tf: {parent: imu, child: sensr}}\n")
    refused = bentwing("info", with_tf, "-p", tmp_path / "typo.yaml")
    assert refused.code == 3
    assert "did you mean sensor?" in refused.err


def test_the_draft_of_a_payload_has_the_mount(bentwing, with_tf, tmp_path):
    said = bentwing("payload", "init", with_tf, "-o", tmp_path / "payload.yaml")
    assert said.code == 0, said.err
    drafted = Payload.load(tmp_path / "payload.yaml")
    assert drafted.T_imu_lidar.translation == (0.0, 0.0, 0.2)
    np.testing.assert_allclose(drafted.T_imu_lidar.pose.R @ [0, 0, 1], [1, 0, 0], atol=1e-9)
    assert "# /tf_static has the pose of the lidar" in said.out
    assert "# T_imu_lidar:" not in said.out


def test_a_run_without_a_payload_has_the_mount_in_its_settings(with_tf):
    with Head([with_tf], RunSettings(), as_progress(None)) as head:
        described = head.settings.to_json()["payload"]["T_imu_lidar"]
    assert described["translation"] == [0.0, 0.0, 0.2]
    assert "from_tf" not in described


def test_without_static_transforms_info_says_nothing_of_frames(
    bentwing, ros1, head_entries, tmp_path
):
    said = bentwing("info", ros1.write(tmp_path / "a.bag", head_entries(ros1, 3.0)))
    assert "frames" not in said.out
    assert "T_imu_lidar: {from_tf" not in said.out
