# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from bentwing.base.errors import PayloadError
from bentwing.recording.payload import Payload

EXAMPLE = """
name: bentwing
lidar: {topic: /scan, kind: hokuyo-utm30lx, min_range: 0.3, max_range: 30.0, range_sigma: 0.015}
imu:   {topic: /imu, gyro_noise: 5.0e-4, accel_noise: 8.0e-4, gyro_bias_walk: 1.0e-5, accel_bias_walk: 1.0e-4}
T_imu_lidar: {translation: [0.03, 0.0, -0.05], quaternion: [0.0, 0.0, 0.0, 1.0]}
self_hits: [{box: {min: [-0.4, -0.4, -0.1], max: [0.4, 0.4, 0.5]}}]
encoder: {topic: /encoder, axis: [0, 0, 2], T_imu_motor: {translation: [0, 0, 0.1]}, T_motor_lidar: {}}
gnss: {topic: /fix}
"""


def load(tmp_path, text):
    path = tmp_path / "payload.yaml"
    path.write_text(text)
    return Payload.load(path)


def refusal(tmp_path, text):
    with pytest.raises(PayloadError) as caught:
        load(tmp_path, text)
    message = str(caught.value)
    assert message.startswith(str(tmp_path / "payload.yaml"))
    return message.removeprefix(str(tmp_path / "payload.yaml") + ": ")


def test_the_documented_example_is_read(tmp_path):
    payload = load(tmp_path, EXAMPLE)
    assert payload.lidar.topic == "/scan"
    assert payload.imu.gyro_noise == 5.0e-4
    np.testing.assert_array_equal(payload.T_imu_lidar.pose.matrix[:3, 3], [0.03, 0.0, -0.05])
    assert payload.self_hits[0].box.max == (0.4, 0.4, 0.5)
    assert payload.encoder.axis == (0.0, 0.0, 1.0)
    assert payload.gnss.topic == "/fix"


def test_yaml_numbers_without_a_point_are_numbers(tmp_path):
    assert load(tmp_path, "imu: {gyro_noise: 5e-4}").imu.gyro_noise == 5e-4


@pytest.mark.parametrize(
    ("kind", "max_range"), [("hokuyo-utm30lx", 30.0), ("vlp16", 100.0), ("hesai", 120.0)]
)
def test_ranges_default_by_kind(tmp_path, kind, max_range):
    assert load(tmp_path, f"lidar: {{kind: {kind}}}").lidar.max_range == max_range


def test_without_a_file_a_generic_lidar_is_assumed():
    payload = Payload.default()
    assert payload.lidar.kind == "generic"
    assert payload.lidar.max_range == 100.0
    assert not payload.describes_imu
    assert not payload.places_lidar_on_imu


def test_an_encoder_alone_places_no_lidar(tmp_path):
    assert not load(tmp_path, "encoder: {axis: [0, 0, 1]}").places_lidar_on_imu
    for pose in ("T_imu_motor", "T_motor_lidar"):
        assert load(tmp_path, f"encoder: {{{pose}: {{}}}}").places_lidar_on_imu


def test_naming_the_imu_or_its_place_describes_an_imu(tmp_path):
    assert load(tmp_path, "imu: {topic: /imu}").describes_imu
    assert load(tmp_path, "T_imu_lidar: {}").describes_imu
    assert not load(tmp_path, "imu: null").describes_imu


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("lidar: {max_rang: 5}", "lidar: unknown key 'max_rang'; did you mean 'max_range'?"),
        ("lidr: {}", "unknown key 'lidr'; did you mean 'lidar'?"),
        (
            "encoder: {T_imu_motor: {translaton: [0, 0, 0]}}",
            "encoder.T_imu_motor: unknown key 'translaton'; did you mean 'translation'?",
        ),
        (
            "self_hits: [{box: {min: [0, 0, 0], mx: [1, 1, 1], max: [1, 1, 1]}}]",
            "self_hits[0].box: unknown key 'mx'; did you mean 'max'?",
        ),
    ],
)
def test_unknown_keys_are_refused_with_the_nearest_name(tmp_path, text, message):
    assert refusal(tmp_path, text) == message


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("T_imu_lidar: {quaternion: [0, 0, 0, 2]}", ["T_imu_lidar.quaternion", "norm 2"]),
        ("T_imu_lidar: {quaternion: [0, 0, 0, 0]}", ["T_imu_lidar.quaternion", "norm 0"]),
        ("T_imu_lidar: {quaternion: [.nan, 0, 0, 1]}", ["T_imu_lidar.quaternion", "finite"]),
        ("T_imu_lidar: {translation: [300, 0, 0]}", ["T_imu_lidar.translation", "300 m"]),
        ("encoder: {axis: [0, 0, 0]}", ["encoder.axis", "length 0"]),
        ("lidar: {min_range: 5, max_range: 2}", ["lidar", "min_range 5 m"]),
        ("lidar: {kind: hokujo}", ["lidar.kind", "hokujo", "hokuyo-utm30lx"]),
        ("lidar: {range_sigma: -1}", ["lidar.range_sigma", "-1"]),
        ("gnss: {}", ["gnss", "topic", "lever_arm"]),
        ("- 1\n- 2", ["expected a mapping", "list"]),
        ("lidar: {", ["not valid YAML"]),
        ("", ["expected a mapping"]),
    ],
)
def test_impossible_values_are_refused_with_their_place(tmp_path, text, parts):
    message = refusal(tmp_path, text)
    assert all(part in message for part in parts), message
    assert "\n" not in message


def test_all_problems_come_in_one_sentence(tmp_path):
    message = refusal(tmp_path, "lidar: {max_rang: 5}\nencoder: {axis: [0, 0, 0]}")
    assert "max_rang" in message
    assert "encoder.axis" in message


def test_a_missing_file_is_a_payload_error(tmp_path):
    with pytest.raises(PayloadError, match="no such file"):
        Payload.load(tmp_path / "none.yaml")


def test_a_binary_file_is_a_payload_error(tmp_path):
    path = tmp_path / "payload.yaml"
    path.write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(PayloadError):
        Payload.load(path)


def test_quaternions_rounded_to_three_digits_are_normalized(tmp_path):
    text = "T_imu_lidar: {quaternion: [0.5005, 0.5, 0.5, 0.5]}"
    transform = load(tmp_path, text).T_imu_lidar
    assert np.linalg.norm(transform.quaternion) == pytest.approx(1.0, abs=1e-15)
    R = transform.pose.matrix[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)


def test_the_matrix_turns_as_the_hamilton_quaternion_says(tmp_path):
    half = np.sqrt(0.5)
    text = f"T_imu_lidar: {{quaternion: [0, 0, {half}, {half}]}}"
    R = load(tmp_path, text).T_imu_lidar.pose.matrix[:3, :3]
    np.testing.assert_allclose(R @ [1, 0, 0], [0, 1, 0], atol=1e-12)


def test_metadata_lie_beside_the_payload_file(tmp_path):
    payload = load(tmp_path, "lidar: {kind: ouster, metadata: os1.json}")
    assert payload.lidar.metadata == str(tmp_path / "os1.json")
    assert load(tmp_path, "lidar: {metadata: /data/os1.json}").lidar.metadata == "/data/os1.json"


def test_an_unknown_model_is_refused(tmp_path):
    message = refusal(tmp_path, "lidar: {model: vlp-16}")
    assert message.startswith("lidar.model: ")
    assert "'vlp16'" in message
    assert message.endswith("found 'vlp-16'")
