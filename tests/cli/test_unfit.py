# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recordings that no 3D map can be made of, as a user maps them."""

from __future__ import annotations

import json

import pytest

from bentwing.simulate.faults import with_fault


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
    assert len([line for line in said.err.splitlines() if "error" in line]) == 1
    assert not (tmp_path / "run").exists()


def test_force_maps_it_and_the_record_says_so(bentwing, unfit, tmp_path):
    said = bentwing("map", *unfit, "-o", tmp_path / "run", "--force")
    assert said.code == 4, said.err
    record = json.loads((tmp_path / "run" / "run.json").read_text())
    assert record["settings"]["force"] is True
    assert record["verdict"]["state"] == "failed"
    assert {reason["kind"] for reason in record["verdict"]["reasons"]} & {"slice", "lost"}
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


def test_a_map_that_is_wrong_ends_with_exit_code_4_and_all_files(office, bentwing, tmp_path):
    """The gyro turns the other way; nothing in the samples themselves shows it."""
    with_fault(office / "recording.bag", office / "payload.yaml", "gyro-negated", tmp_path, seed=1)
    out = tmp_path / "run"
    said = bentwing(
        "map", tmp_path / "recording.bag", "-p", tmp_path / "payload.yaml", "-o", out,
        "--map-spacing", "0.1", "--threads", "1", "--trust-payload",
    )  # fmt: skip
    assert said.code == 4
    assert f"bentwing: error: {out}: failed: " in said.err
    assert "open" in said.err
    assert str(out / "report.html") in said.err
    record = json.loads((out / "run.json").read_text())
    assert record["complete"] is True
    assert record["verdict"]["state"] == "failed"
    assert all((out / name).exists() for name in ("trajectory.txt", "map.laz", "report.html"))
    page = (out / "report.html").read_text()
    assert "Failed: this map is wrong, do not use it" in page
    assert "Map finished" not in page


def test_a_map_that_can_be_put_right_is_and_says_so_first(office, bentwing, tmp_path):
    with_fault(
        office / "recording.bag", office / "payload.yaml", "gyro-one-negated", tmp_path, seed=1
    )
    out = tmp_path / "run"
    said = bentwing(
        "map", tmp_path / "recording.bag", "-p", tmp_path / "payload.yaml", "-o", out,
        "--map-spacing", "0.1",
    )  # fmt: skip
    assert said.code == 0, said.err
    line = "imu: {axes: [x, y, z], gyro_axes: [x, y, -z]}"
    assert line in said.err
    record = json.loads((out / "run.json").read_text())
    assert [(found["kind"], found["line"]) for found in record["set_up"]] == [("axes", line)]
    assert record["verdict"]["state"] == "good"
    assert line in (out / "report.html").read_text()
