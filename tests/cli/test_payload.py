# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing payload init` and `--write-payload` as a user runs them."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml

from bentwing.recording import Payload


def init(bentwing, bag, out, *options):
    """The payload that is written, and its text."""
    said = bentwing("payload", "init", bag, "-o", out, *options)
    assert said.code == 0, said.err
    return Payload.load(out), out.read_text(encoding="utf-8")


def test_topics_and_kinds_of_a_flight_are_found_and_the_rest_is_asked(bentwing, office, tmp_path):
    found, text = init(bentwing, office / "recording.bag", tmp_path / "payload.yaml")
    true = Payload.load(office / "payload.yaml")
    assert found.lidar.topic == true.lidar.topic
    assert found.lidar.kind == true.lidar.kind == "hokuyo-utm30lx"
    assert found.imu.topic == true.imu.topic
    assert found.encoder is None
    for question in ("# T_imu_lidar:", "# self_hits:", "#   gyro_noise:"):
        assert question in text


def test_an_answer_is_given_by_removing_the_sign_in_front_of_it(bentwing, office, tmp_path):
    path = tmp_path / "payload.yaml"
    _, text = init(bentwing, office / "recording.bag", path)
    path.write_text(text.replace("# T_imu_lidar", "T_imu_lidar").replace("# self_hits", "self_hits")
                    .replace("#   - box", "  - box"))  # fmt: skip
    answered = Payload.load(path)
    assert answered.places_lidar_on_imu
    assert len(answered.self_hits) == 1


def test_the_joint_that_turns_is_the_encoder_and_a_still_one_is_not(bentwing, tmp_path, ros1):
    def bag(name, angle):
        entries = [("/scan", i / 40, ros1.scan(i / 40)) for i in range(40)]
        entries += [
            ("/joints", i / 40, ros1.joint(i / 40, (0.3, angle(i / 40)), names=("arm", "motor")))
            for i in range(40)
        ]
        return ros1.write(tmp_path / name, sorted(entries, key=lambda entry: entry[1]))

    turning, _ = init(bentwing, bag("a.bag", lambda t: 6.0 * t), tmp_path / "a.yaml")
    assert turning.encoder.joint == "motor"
    still, text = init(bentwing, bag("b.bag", lambda _: 0.3), tmp_path / "b.yaml")
    assert still.encoder is None
    assert "T_imu_motor" not in text


def test_a_2d_lidar_of_another_make_has_its_own_ranges(bentwing, tmp_path, ros1):
    scans = [
        ("/scan", i / 40, ros1.scan(i / 40, range_min=0.15, range_max=12.0)) for i in range(40)
    ]
    found, text = init(bentwing, ros1.write(tmp_path / "a.bag", scans), tmp_path / "a.yaml")
    assert (found.lidar.kind, found.lidar.min_range, found.lidar.max_range) == (
        "generic",
        0.15,
        12.0,
    )
    assert "its kind, which decides" in text


@pytest.mark.parametrize(
    ("topic", "n_beams", "kind"),
    [("/points", 16, "vlp16"), ("/points", 32, "generic"), ("/ouster/points", 64, "ouster"),
     ("/hesai/pandar", 40, "hesai"), ("/livox/lidar", 6, "livox")],
)  # fmt: skip
def test_the_kind_of_a_3d_lidar_is_told_by_name_and_beams(
    bentwing, tmp_path, ros1, topic, n_beams, kind
):
    table = np.ones(
        n_beams, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("ring", "u2"), ("time", "f4")]
    )
    table["ring"] = np.arange(n_beams)
    clouds = [(topic, i / 10, ros1.cloud(i / 10, table)) for i in range(4)]
    found, _ = init(bentwing, ros1.write(tmp_path / "a.bag", clouds), tmp_path / "a.yaml")
    assert found.lidar.kind == kind


def test_other_topics_that_could_be_meant_and_gnss_are_named(bentwing, tmp_path, ros1):
    entries = [("/scan", i / 40, ros1.scan(i / 40)) for i in range(40)]
    entries += [("/imu/data", i / 40, ros1.imu(i / 40)) for i in range(40)]
    entries += [("/camera/imu", i / 10, ros1.imu(i / 10)) for i in range(10)]
    bag = ros1.write(tmp_path / "a.bag", sorted(entries, key=lambda entry: entry[1]))
    found, text = init(bentwing, bag, tmp_path / "a.yaml")
    assert found.imu.topic == "/imu/data"
    assert "# Into imu, if it is rather one of these: topic: /camera/imu" in text


@pytest.mark.parametrize(
    "command", [("payload", "init"), ("info", "--write-payload"), ("map", "--write-payload")]
)
def test_an_existing_file_is_refused_before_anything_is_read(bentwing, tmp_path, command):
    existing = tmp_path / "payload.yaml"
    existing.write_text("name: mine")
    name, option = command
    bag = tmp_path / "none.bag"
    arguments = {
        "payload": ("init", bag, "-o", existing),
        "info": (bag, option, existing),
        "map": (bag, "-o", tmp_path / "run", option, existing),
    }[name]
    said = bentwing(name, *arguments)
    assert said.code == 2
    assert "payload.yaml: exists already" in said.err
    assert existing.read_text() == "name: mine"


def test_a_recording_without_lidar_is_refused(bentwing, tmp_path, ros1):
    bag = ros1.write(tmp_path / "a.bag", [("/imu", i / 40, ros1.imu(i / 40)) for i in range(40)])
    said = bentwing("payload", "init", bag, "-o", tmp_path / "payload.yaml")
    assert said.code == 3
    assert "no lidar topic" in said.err
    assert not (tmp_path / "payload.yaml").exists()


def test_info_writes_what_it_was_given_or_what_the_recording_tells(bentwing, office, tmp_path):
    bag, given = office / "recording.bag", office / "payload.yaml"
    bentwing("info", bag, "-p", given, "--write-payload", tmp_path / "given.yaml")
    assert Payload.load(tmp_path / "given.yaml") == Payload.load(given)
    bentwing("info", bag, "--write-payload", tmp_path / "told.yaml")
    assert Payload.load(tmp_path / "told.yaml").lidar.kind == "hokuyo-utm30lx"


def test_info_proposes_and_writes_boxes_around_the_carrier(
    bentwing, office, tmp_path, changed_payload
):
    bag, bare = office / "recording.bag", changed_payload(self_hits=None)
    said = bentwing("info", bag, "-p", bare, "--write-payload", tmp_path / "boxed.yaml")
    assert said.code == 0, said.err
    assert "carrier    seen from (" in said.out
    boxes = Payload.load(tmp_path / "boxed.yaml").self_hits
    assert 1 <= len(boxes) <= 4
    found = json.loads(bentwing("info", bag, "-p", bare, "--json").out)
    assert [one["box"]["min"] for one in found["self_hits"]] == [list(b.box.min) for b in boxes]
    (warning,) = [text for text in found["warnings"] if "its own carrier" in text]
    assert f"min: {list(boxes[0].box.min)}" in warning
    masked = json.loads(bentwing("info", bag, "-p", office / "payload.yaml", "--json").out)
    assert masked["self_hits"] == []


@pytest.mark.slow
def test_map_says_once_that_the_carrier_comes_into_it(bentwing, office, tmp_path, changed_payload):
    out = tmp_path / "run"
    said = bentwing(
        "map", office / "recording.bag", "-p", changed_payload(self_hits=None), "-o", out,
        "--no-loop-closure", "--map-spacing", 0.2,
    )  # fmt: skip
    assert said.code == 0, said.err
    warnings = json.loads((out / "run.json").read_text())["warnings"]
    assert sum("its own carrier" in text for text in warnings) == 1
    assert " ".join((said.out + said.err).split()).count("its own carrier") == 1


@pytest.mark.slow
def test_map_writes_the_head_as_the_run_has_found_it(bentwing, office, tmp_path):
    path = tmp_path / "found.yaml"
    said = bentwing(
        "map", office / "recording.bag", "-p", office / "payload.yaml", "-o", tmp_path / "run",
        "--no-loop-closure", "--map-spacing", 0.2, "--write-payload", path,
    )  # fmt: skip
    assert said.code == 0, said.err
    found = Payload.load(path)
    true = yaml.safe_load((office / "truth_calibration.yaml").read_text())
    (std,) = found.calibration.std["latency"]
    assert 0 < std < 1e-3
    assert abs(found.lidar.latency - true["latency"]) < 5 * std + 2e-4
    translation = np.array(found.T_imu_lidar.translation)
    away = np.abs(translation - true["T_imu_lidar"]["translation"])
    assert (away < 0.01).all()
    assert set(found.calibration.std) == {"latency", "extrinsic_rotation", "extrinsic_translation"}


@pytest.mark.slow
def test_what_map_writes_of_a_head_it_had_to_find_needs_no_repair(bentwing, office, tmp_path):
    bag, path = office / "recording.bag", tmp_path / "found.yaml"
    fast = ("--no-loop-closure", "--map-spacing", 0.2)
    said = bentwing("map", bag, "-o", tmp_path / "first", *fast, "--write-payload", path)
    assert said.code == 0, said.err
    found = Payload.load(path)
    assert found.imu.topic
    assert found.places_lidar_on_imu
    said = bentwing("map", bag, "-p", path, "-o", tmp_path / "second", *fast)
    assert said.code == 0, said.err
    first, second = (
        json.loads((tmp_path / run / "run.json").read_text()) for run in ("first", "second")
    )
    assert first["set_up"]
    assert not second["set_up"]


def test_several_flights_have_no_one_payload(bentwing, office, tmp_path, changed_bag):
    bag = office / "recording.bag"
    later = changed_bag(lambda _, t, message: [(t + 500.0, message)], until=2.0)
    said = bentwing(
        "map", bag, later, "-p", office / "payload.yaml", "-o", tmp_path / "run",
        "--write-payload", tmp_path / "found.yaml",
    )  # fmt: skip
    assert said.code == 2
    assert "--write-payload with 2 flights" in said.err


def test_ready_payloads_are_listed_and_can_be_named(bentwing, tmp_path, ros1):
    listed = bentwing("payload", "list")
    assert listed.code == 0
    assert "dataset:hilti-2022" in listed.out
    table = np.ones(64, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("time", "f4")])
    clouds = [("/velodyne_points", i / 10, ros1.cloud(i / 10, table)) for i in range(4)]
    bag = ros1.write(tmp_path / "a.bag", clouds)
    refused = bentwing("info", bag, "-p", "dataset:m2dgr")
    assert "names the imu topic /handsfree/imu" in " ".join(refused.out.split())
    unknown = bentwing("info", bag, "-p", "dataset:m2gdr")
    assert unknown.code == 3
    assert "give one of" in unknown.err


@pytest.mark.parametrize(
    ("words", "says"),
    [(["init"], "needs the recording"), (["list", "a.bag"], "neither recordings nor --out")],
)
def test_an_action_with_too_little_or_too_much_is_refused(bentwing, words, says):
    said = bentwing("payload", *words)
    assert said.code == 2
    assert says in said.err
