# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing plan` and `bentwing reproduce` as a user runs them."""

from __future__ import annotations

import json

import pytest
import yaml

DOWN = {"translation": [0.0, 0.0, 0.0], "quaternion": [0.0, 0.70710678, 0.0, 0.70710678]}
HEADS = {
    "spun": {"lidar": {"kind": "hokuyo-utm30lx"}, "imu": {}, "T_imu_lidar": DOWN},
    "motor": {"lidar": {"kind": "vlp16"}, "encoder": {"T_motor_lidar": DOWN}},
    "fixed": {"lidar": {"kind": "ouster"}},
    "level": {"lidar": {"kind": "hokuyo-utm30lx"}, "imu": {}, "T_imu_lidar": {}},
}


@pytest.fixture
def payload(tmp_path):
    def write(name):
        path = tmp_path / f"{name}.yaml"
        path.write_text(yaml.safe_dump(HEADS[name]))
        return path

    return write


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("spun", ["150 to 460 °/s", "blind cone: 90° above", "zenith", "22.4 cm"]),
        ("motor", ["turned by its motor", "100% of the sphere"]),
        ("fixed", ["not turned"]),
        ("level", ["stays in itself"]),
    ],
)
def test_every_kind_of_payload_gets_a_page(bentwing, payload, name, said):
    result = bentwing("plan", payload(name))
    assert result.code == 0, result.err
    for text in said:
        assert text in result.out


def test_json_is_machine_readable(bentwing, payload):
    result = bentwing("plan", payload("spun"), "--json", "--distance", "10", "--scan-rate", "40")
    found = json.loads(result.out)
    assert found["spin_rate_deg"]["highest"] == pytest.approx(91.7, abs=0.1)
    assert found["turned"] == "downdraft"


def test_the_sphere_is_drawn(bentwing, payload, tmp_path):
    picture = tmp_path / "sphere.svg"
    assert bentwing("plan", payload("spun"), "--picture", picture).code == 0
    assert picture.read_text().startswith("<svg")


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        (["--distance", "50"], 2, "beyond the 30 m"),
        (["--speed", "-1"], 2, "speed"),
        (["--speed", "fast"], 2, "--speed"),
    ],
)
def test_a_wrong_call_is_told_in_one_sentence(bentwing, payload, options, code, said):
    result = bentwing("plan", payload("spun"), *options)
    assert result.code == code
    assert said in result.err


def test_a_payload_that_cannot_be_used_is_named(bentwing, tmp_path):
    assert bentwing("plan", tmp_path / "none.yaml").code == 3
    broken = tmp_path / "broken.yaml"
    broken.write_text("lidar: {kind: sonar}\n")
    result = bentwing("plan", broken)
    assert result.code == 3
    assert "broken.yaml" in result.err


def test_what_cannot_be_reproduced_is_told(bentwing, tmp_path):
    result = bentwing("reproduce", "nobody1999", "-o", tmp_path / "out")
    assert (result.code, "kaul2015" in result.err) == (2, True)
    result = bentwing("reproduce", "kaul2015", "--part", "soup", "-o", tmp_path / "out")
    assert (result.code, "flight" in result.err) == (2, True)
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_the_flight_figures_are_made_again(bentwing, tmp_path):
    out = tmp_path / "out"
    result = bentwing("reproduce", "kaul2015", "--part", "flight", "--quick", "-o", out)
    assert result.code == 0, result.err
    names = {path.name for path in out.iterdir()}
    figures = ("fig09a", "fig09b", "fig10", "fig11", "fig26a", "fig26b")
    assert names == {
        "report.html",
        "flight.json",
        *(f"{name}.{kind}" for name in figures for kind in ("svg", "png")),
    }
    numbers = json.loads((out / "flight.json").read_text())
    assert numbers["fig11_largest_overshoot_deg"] > 50.0
