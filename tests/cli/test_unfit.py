# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recordings that no 3D map can be made of, as a user maps them."""

from __future__ import annotations

import json

import pytest


@pytest.fixture(params=["2d_only.bag", "level_2d_with_imu.bag"])
def unfit(request, shared_cases):
    """Return the arguments that name an unfit recording."""
    folder = shared_cases / "map_accepts_unfit"
    has_imu = "imu" in request.param
    return [folder / request.param, *(["-p", folder / "payload.yaml"] if has_imu else [])]


def test_map_refuses_what_info_refuses_and_writes_nothing(bentwing, unfit, tmp_path):
    told, said = bentwing("info", *unfit), bentwing("map", *unfit, "-o", tmp_path / "run")
    assert told.code == said.code == 3
    assert "a 2D lidar w" in said.err
    assert said.err.rstrip().endswith("to map it all the same, give --force")
    assert len(said.err.splitlines()) == 1
    assert not (tmp_path / "run").exists()


def test_force_maps_it_and_the_record_says_so(bentwing, unfit, tmp_path):
    said = bentwing("map", *unfit, "-o", tmp_path / "run", "--force")
    assert said.code == 0, said.err
    record = json.loads((tmp_path / "run" / "run.json").read_text())
    assert record["settings"]["force"] is True
    assert record["warnings"]
    for warning in record["warnings"]:
        assert said.err.count(warning) == 1


@pytest.mark.slow
def test_a_car_without_an_imu_is_told_nothing_about_one(bentwing, shared_data, tmp_path):
    said = bentwing("map", shared_data / "drive_hdl64" / "start_16m.bag", "-o", tmp_path / "run")
    assert said.code == 0, said.err
    for warning in json.loads((tmp_path / "run" / "run.json").read_text())["warnings"]:
        assert said.err.count(warning) == 1
    assert "IMU" not in said.err
