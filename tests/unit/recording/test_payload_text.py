# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

from pathlib import Path

import pytest

from bentwing.recording import Payload

HEAD = {
    "name": "spinner",
    "lidar": {"kind": "hokuyo-utm30lx", "range_sigma": 0.01, "max_range": 30.0},
    "imu": {"axes": ["y", "-x", "z"]},
    "T_imu_lidar": {"translation": [0.03, 0.0, -0.05]},
    "self_hits": [{"box": {"min": [-0.4, -0.4, -0.1], "max": [0.4, 0.4, 0.5]}}],
    "calibration": {"std": {"latency": [1e-5]}, "not_observable": ["the delay: at one rate"]},
}
TEXT = """\
name: spinner
lidar:
  kind: hokuyo-utm30lx
  range_sigma: 0.01                         # m, one standard deviation
imu:
  axes: [y, -x, z]
T_imu_lidar:
  translation: [0.03, 0.0, -0.05]           # m
self_hits:
  - box: {min: [-0.4, -0.4, -0.1], max: [0.4, 0.4, 0.5]}
calibration:
  std:
    latency: [1.0e-05]                      # s
  not_observable:
    - 'the delay: at one rate'
"""


def test_a_head_is_written_with_units_and_without_what_its_kind_has_anyway():
    assert Payload.model_validate(HEAD).to_yaml() == TEXT


@pytest.mark.parametrize("section", ["imu: {}", "imu: null", "T_imu_lidar: {}", "encoder: {}"])
def test_a_section_that_says_something_by_being_there_is_written(tmp_path, section):
    path = tmp_path / "payload.yaml"
    path.write_text(section)
    payload = Payload.load(path)
    assert payload.to_yaml() == f"{section}\n"


def test_a_head_of_which_nothing_is_known_is_written_and_read(tmp_path):
    Payload().save(tmp_path / "payload.yaml")
    assert Payload.load(tmp_path / "payload.yaml") == Payload()


def test_metadata_are_found_from_wherever_the_payload_is_saved(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for folder in ("heads", "out"):
        Path(folder).mkdir()
    Path("heads/payload.yaml").write_text("lidar: {kind: ouster, metadata: os1.json}")
    payload = Payload.load("heads/payload.yaml")
    payload.save("out/payload.yaml")
    assert Payload.load("out/payload.yaml") == payload
    assert "metadata: ../heads/os1.json" in Path("out/payload.yaml").read_text()
