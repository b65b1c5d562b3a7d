# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a payload says of a transform as angles or matrix, and what it may not say."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base.errors import PayloadError
from bentwing.recording.payload import Payload

# The lidar on its side, x up: points along its z are along the IMU's x.
SIDE = [[0, 0, 1, 0.1], [0, 1, 0, 0.2], [-1, 0, 0, 0.3], [0, 0, 0, 1]]


def load(tmp_path, text):
    path = tmp_path / "payload.yaml"
    path.write_text(text)
    return Payload.load(path)


@pytest.mark.parametrize(
    "text",
    [
        "{translation: [0.1, 0.2, 0.3], quaternion: [0, 0.7071, 0, 0.7071]}",
        "{translation: [0.1, 0.2, 0.3], rpy: [0, 1.57079633, 0]}",
        "{translation: [0.1, 0.2, 0.3], rpy_deg: [0, 90, 0]}",
        f"{{matrix: {SIDE}}}",
    ],
)
@pytest.mark.parametrize("key", ["T_imu_lidar", "T_imu_motor", "T_motor_lidar"])
def test_every_form_of_one_mount_is_the_same_transform(tmp_path, key, text):
    if key == "T_imu_lidar":
        given = load(tmp_path, f"T_imu_lidar: {text}").T_imu_lidar
    else:
        given = getattr(load(tmp_path, f"encoder: {{{key}: {text}}}").encoder, key)
    np.testing.assert_allclose(given.pose.matrix, SIDE, atol=1e-4)


def test_the_pose_takes_points_of_the_lidar_to_the_imu(tmp_path):
    pose = load(
        tmp_path, "T_imu_lidar: {translation: [1, 0, 0], rpy: [0, 0, 1.57079633]}"
    ).T_imu_lidar.pose
    np.testing.assert_allclose(pose.matrix @ [2, 0, 0, 1], [1, 2, 0, 1], atol=1e-6)


def test_roll_is_turned_first_and_yaw_last(tmp_path):
    R = load(tmp_path, "T_imu_lidar: {rpy_deg: [90, 0, 90]}").T_imu_lidar.pose.R
    np.testing.assert_allclose(R @ [0, 0, 1], [1, 0, 0], atol=1e-9)  # z to -y by roll, to x by yaw


def test_what_was_given_as_angles_is_written_as_a_quaternion(tmp_path):
    text = load(tmp_path, "T_imu_lidar: {rpy_deg: [0, 0, 180]}").to_yaml()
    assert "quaternion" in text
    assert "rpy" not in text
    assert "from_tf" not in text


def test_a_matrix_rounded_to_three_digits_is_the_nearest_rotation(tmp_path):
    c, s = float(np.cos(0.7)), float(np.sin(0.7))
    rows = [
        [round(c, 3), -round(s, 3), 0, 0],
        [round(s, 3), round(c, 3), 0, 0],
        [0, 0, 1, 0],
        [0, 0, 0, 1],
    ]
    R = load(tmp_path, f"T_imu_lidar: {{matrix: {rows}}}").T_imu_lidar.pose.R
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(R[:2, :2], [[c, -s], [s, c]], atol=1e-3)


ROWS = "[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]"


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("{rpy: [0, 90, 0]}", ("90 rad", "more than a whole turn", "rpy_deg")),
        ("{rpy_deg: [0, 900, 0]}", ("900 deg", "more than a whole turn")),
        ("{rpy: [0, 1]}", ("[roll, pitch, yaw] in rad", "[0, 1]")),
        ("{rpy: [0, .nan, 1]}", ("[roll, pitch, yaw]", "nan")),
        ("{rpy: up}", ("[roll, pitch, yaw]", "up")),
        (f"{{matrix: [[1, 0, 0, 0], {ROWS.replace('0, 0, 0, 1', '0.1, 0, 0, 1')}]}}", ("last row [0.1, 0.0, 0.0, 1.0]",)),
        (f"{{matrix: [[1.1, 0, 0, 0], {ROWS}]}}", ("no rotation", "0.21")),
        (f"{{matrix: [[1.0e+200, 0, 0, 0], {ROWS}]}}", ("no rotation", "1e+200")),
        (f"{{matrix: [[-1, 0, 0, 0], {ROWS}]}}", ("mirrors", "determinant -1")),
        ("{matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}", ("4 rows of 4 numbers",)),
        (f"{{matrix: [[1, 0, 0, 99], {ROWS}]}}", ("99 m long", "in metres")),
        (f"{{translation: [1, 0, 0], matrix: [[1, 0, 0, 0], {ROWS}]}}", ("leave translation out",)),
        ("{rpy: [0, 0, 0], quaternion: [0, 0, 0, 1]}", ("as quaternion and as rpy",)),
        ("{translation: [0, 0, 1], from_tf: {parent: a, child: b}}", ("leave translation out",)),
        ("{from_tf: {parent: a}}", ("T_imu_lidar.from_tf.child: required",)),
        ("{matrx: 1}", ("did you mean 'matrix'",)),
    ],
)  # fmt: skip
def test_what_is_no_transform_is_refused_with_the_figure(tmp_path, text, parts):
    with pytest.raises(PayloadError) as refused:
        load(tmp_path, f"T_imu_lidar: {text}")
    for part in ("payload.yaml: T_imu_lidar", *parts):
        assert part in str(refused.value)


def test_a_reference_is_kept_in_the_file_and_is_no_pose_without_a_recording(tmp_path):
    head = load(tmp_path, "T_imu_lidar: {from_tf: {parent: imu_link, child: lidar_link}}")
    assert head.places_lidar_on_imu
    head.save(tmp_path / "again.yaml")
    assert Payload.load(tmp_path / "again.yaml") == head
    assert head.model_dump()["T_imu_lidar"] == {
        "from_tf": {"parent": "imu_link", "child": "lidar_link"}
    }
    with pytest.raises(PayloadError, match=r"lidar_link in imu_link .* /tf_static"):
        _ = head.T_imu_lidar.pose


@pytest.mark.parametrize("left_out", ["exclude_defaults", "exclude_unset", "exclude_none"])
def test_a_transform_can_be_written_without_what_goes_without_saying(tmp_path, left_out):
    payload = load(tmp_path, "T_imu_lidar: {}")
    assert "from_tf" not in payload.model_dump(**{left_out: True}).get("T_imu_lidar", {})
