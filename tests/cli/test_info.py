# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing info` as a user runs it."""

from __future__ import annotations

import json

import pytest


@pytest.fixture
def head(tmp_path, ros1, head_entries):
    return ros1.write(tmp_path / "head.bag", head_entries(ros1))


def test_the_page_tells_topics_spin_and_verdict(bentwing, head):
    result = bentwing("info", head)
    assert result.code == 0, result.err
    for text in ("/scan", "/imu", "39.6", "4.00 rad/s", "time per beam", "fit for mapping"):
        assert text in result.out


def test_json_is_machine_readable(bentwing, head):
    result = bentwing("info", head, "--json")
    found = json.loads(result.out)
    assert found["is_fit"] is True
    assert {topic["role"] for topic in found["topics"]} == {"lidar", "imu"}
    assert found["structure"]["far_share"] == 0.0


def test_the_payload_is_used(bentwing, head, tmp_path):
    payload = tmp_path / "payload.yaml"
    payload.write_text("encoder: {topic: /encoder}")
    assert "names the encoder topic /encoder" in " ".join(
        bentwing("info", head, "--payload", payload).out.split()
    )


def test_a_bad_payload_is_refused(bentwing, head, tmp_path):
    payload = tmp_path / "payload.yaml"
    payload.write_text("lidar: {max_rang: 3}")
    said = bentwing("info", head, "--payload", payload)
    assert said.code == 3
    assert "did you mean 'max_range'?" in said.err


def test_a_missing_recording_is_refused(bentwing, tmp_path):
    said = bentwing("info", tmp_path / "none.bag")
    assert said.code == 3
    assert "none.bag" in said.err


def test_several_parts_are_one_recording(bentwing, tmp_path, ros1, head_entries):
    entries = head_entries(ros1)
    parts = [
        ros1.write(tmp_path / f"{i}.bag", entries[start:stop])
        for i, (start, stop) in enumerate([(0, 240), (240, None)])
    ]
    found = json.loads(bentwing("info", *parts, "--json").out)
    assert {topic["count"] for topic in found["topics"]} == {80, 400}


def test_the_planar_rover_is_refused_for_its_real_defects(bentwing, shared_data):
    said = bentwing("info", shared_data / "planar_rover" / "loop2", "--json")
    found = json.loads(said.out)
    assert said.code == 3
    assert not found["is_fit"]
    defects = "\n".join(found["defects"])
    for text in (
        "in milli-g",
        "multiply by 0.00980665",
        "in deg/s",
        "multiply by 0.0174533",
        "one axis is mirrored",
        "cannot make a 3D map",
    ):
        assert text in defects
    assert len(found["defects"]) == 4
    (times,) = [text for text in found["warnings"] if "time per beam made" in text]
    assert "one turn of 136.7" in times
    assert "last point (as the recorder's times say)" in times


def test_the_page_of_an_unfit_recording_is_printed_and_the_exit_code_is_3(bentwing, tmp_path, ros1):
    scans = [("/scan", i / 40, ros1.scan(i / 40)) for i in range(40)]
    said = bentwing("info", ros1.write(tmp_path / "2d.bag", scans))
    assert said.code == 3
    assert "without IMU and encoder" in said.out
    assert "not fit for mapping: 1 defect" in said.out


def test_the_ouster_file_is_refused_for_its_two_clocks(bentwing, shared_data):
    found = json.loads(
        bentwing("info", shared_data / "packets" / "ouster_os1_64.mcap", "--json").out
    )
    (defect,) = found["defects"]
    assert "stamped by clocks" in defect


def test_times_that_are_made_are_said_once_and_do_not_make_a_recording_unfit(
    bentwing, tmp_path, ros1, head_entries
):
    entries = head_entries(ros1, 4.0)
    for topic, _, message in entries:
        if topic == "/scan":
            message.time_increment = message.scan_time = 0.0
    path = ros1.write(tmp_path / "a.bag", entries)
    said = " ".join(bentwing("info", path).out.split())
    assert said.count("time per beam made from the angle") == 1
    assert "no time per" not in said
